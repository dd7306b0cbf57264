// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/remaining_time.h"

#include <algorithm>
#include <utility>

namespace carillon::precompute {
namespace {

/// So much of the prediction is taken on trust, so that the first milliseconds measured do not
/// decide.
constexpr double kTrust_s = 0.05;
/// Passing time alone completes at most this part of the step that the last report left open.
constexpr double kMostByTime = 0.95;

}  // namespace

void RemainingTime::BeginRound(double now_s, const RoundForecast& forecast) {
  if (under_way_) Go(now_s, steps_.size());
  forecast_ = forecast;
  round_begun_s_ = now_s;
  steps_.clear();
  under_way_ = false;
}

void RemainingTime::Plan(double now_s, std::vector<PlannedStep> steps) {
  const bool first = steps_.empty();
  steps_ = std::move(steps);
  if (!first) return;
  step_ = 0;
  under_way_ = false;
  step_begun_s_ = now_s;
  fraction_ = 0;
}

void RemainingTime::Progress(double now_s, v1::Phase phase, double fraction) {
  if (steps_.empty()) return;
  if (!under_way_ || current() == nullptr || current()->phase != phase) {
    const auto is_it = [phase](const PlannedStep& step) { return step.phase == phase; };
    const auto here = steps_.begin() + static_cast<std::ptrdiff_t>(std::min(step_, steps_.size()));
    auto found = std::find_if(here, steps_.end(), is_it);
    // A solution that missed a mode is tried again.
    if (found == steps_.end()) found = std::find_if(steps_.begin(), steps_.end(), is_it);
    if (found == steps_.end()) return;
    Go(now_s, static_cast<size_t>(found - steps_.begin()));
  }
  if (fraction <= fraction_) return;
  fraction_ = std::min(fraction, 1.0);
  reported_s_ = now_s;
}

void RemainingTime::Go(double now_s, size_t step) {
  if (under_way_ && current() != nullptr) {
    done_s_ += now_s - step_begun_s_;
    predicted_s_ += current()->predicted_s;
  }
  step_ = step;
  under_way_ = step < steps_.size();
  step_begun_s_ = now_s;
  reported_s_ = now_s;
  fraction_ = 0;
}

double RemainingTime::Slowness() const {
  double measured = done_s_ + kTrust_s;
  double predicted = predicted_s_ + kTrust_s;
  if (under_way_ && fraction_ > 0) {
    measured += reported_s_ - step_begun_s_;
    predicted += fraction_ * current()->predicted_s;
  }
  return measured / predicted;
}

double RemainingTime::ThisRound(double now_s) const {
  const double foreseen = std::max(0.0, forecast_.expected_s - (now_s - round_begun_s_));
  if (steps_.empty()) return foreseen;
  const double slowness = Slowness();
  double left = 0;
  for (size_t k = step_; k < steps_.size(); ++k) left += slowness * steps_[k].predicted_s;
  if (!under_way_) return left;
  const double whole = slowness * current()->predicted_s;
  const double open = (1 - fraction_) * whole;
  left += open - whole - std::min(kMostByTime * open, now_s - reported_s_);
  // Until the modes are counted, the round before tells better how many there are.
  return step_ == 0 ? std::max(left, foreseen) : left;
}

std::optional<double> RemainingTime::Seconds(double now_s) const {
  if (steps_.empty() && forecast_.expected_s <= 0) return std::nullopt;
  const double round = ThisRound(now_s);
  return round + forecast_.later_rounds * (now_s - round_begun_s_ + round);
}

}  // namespace carillon::precompute
