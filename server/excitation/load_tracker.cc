// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/load_tracker.h"

#include <algorithm>
#include <numeric>

namespace carillon {
namespace {

/// In common engines, the jitter of resting contacts stays below the usual force times this factor.
constexpr double kUsualFactor = 3;
/// A flight is at least three steps without contact, which take at least 30 ms, as a hop of 1 mm
/// does. A resting contact flickers for one or two steps, or for more if they are shorter.
constexpr size_t kFlightStepCount = 3;
constexpr double kFlightS = 0.03;

}  // namespace

double LoadTracker::Next(double impulse_newton_seconds, double step_s) {
  const double force = impulse_newton_seconds / step_s;
  const double load = kUsualFactor * Usual();
  const double blow = std::max(force - load, 0.0);
  forces_newtons_[next_] = force;
  blows_newtons_[next_] = blow;
  next_ = (next_ + 1) % kStepCount;
  empty_count_ = force > 0 ? 0 : std::min(empty_count_ + 1, kStepCount);
  empty_s_ = force > 0 ? 0 : empty_s_ + step_s;
  if (empty_count_ >= kFlightStepCount && empty_s_ >= kFlightS) ForgetBlows();
  return force > 0 ? blow / force : 0;
}

void LoadTracker::Forget() { forces_newtons_ = blows_newtons_ = {}; }

void LoadTracker::ForgetBlows() {
  for (size_t i = 0; i < kStepCount; ++i) forces_newtons_[i] -= blows_newtons_[i];
  blows_newtons_ = {};
}

bool LoadTracker::has_blows() const {
  return std::ranges::any_of(blows_newtons_, [](double blow) { return blow > 0; });
}

bool LoadTracker::rests() const {
  return !has_blows() && std::ranges::all_of(forces_newtons_, [](double f) { return f > 0; });
}

bool LoadTracker::idle() const { return empty_count_ >= kStepCount; }

double LoadTracker::Usual() const {
  std::array<double, kStepCount> sorted = forces_newtons_;
  const auto middle = sorted.begin() + kStepCount / 2;
  std::ranges::nth_element(sorted, middle);
  const double mean =
      std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(kStepCount);
  return std::max(*middle, mean);
}

}  // namespace carillon
