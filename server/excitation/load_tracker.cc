// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/load_tracker.h"

#include <algorithm>
#include <numeric>

namespace carillon {
namespace {

/// In common engines, the jitter of resting contacts stays below the usual force times this factor.
constexpr double kUsualFactor = 3;
/// So many steps without contact are a flight. Resting contacts flicker for one or two.
constexpr int kFlightStepCount = 3;

}  // namespace

double LoadTracker::Next(double impulse_newton_seconds, double step_s) {
  const double force = impulse_newton_seconds / step_s;
  const double load = kUsualFactor * Usual();
  const double blow = std::max(force - load, 0.0);
  forces_newtons_[next_] = force;
  blows_newtons_[next_] = blow;
  next_ = (next_ + 1) % kStepCount;
  empty_count_ = force > 0 ? 0 : empty_count_ + 1;
  if (empty_count_ == kFlightStepCount) ForgetBlows();
  return force > 0 ? blow / force : 0;
}

void LoadTracker::ForgetBlows() {
  for (size_t i = 0; i < kStepCount; ++i) forces_newtons_[i] -= blows_newtons_[i];
  blows_newtons_ = {};
}

bool LoadTracker::idle() const {
  return std::ranges::all_of(forces_newtons_, [](double force) { return force == 0; });
}

double LoadTracker::Usual() const {
  std::array<double, kStepCount> sorted = forces_newtons_;
  const auto middle = sorted.begin() + kStepCount / 2;
  std::ranges::nth_element(sorted, middle);
  const double mean =
      std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(kStepCount);
  return std::max(*middle, mean);
}

}  // namespace carillon
