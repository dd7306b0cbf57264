// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/load_tracker.h"

#include <algorithm>
#include <numeric>

namespace carillon {
namespace {

/// In common engines, the jitter of resting contacts stays below the usual force times this factor.
constexpr double kUsualFactor = 3;

}  // namespace

double LoadTracker::Next(double impulse_newton_seconds, double step_s) {
  const double force = impulse_newton_seconds / step_s;
  const double load = kUsualFactor * Usual();
  forces_newtons_[next_] = force;
  next_ = (next_ + 1) % kStepCount;
  return force > load ? 1 - load / force : 0;
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
