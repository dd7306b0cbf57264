// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace carillon {

/// The intervals of simulation time between the steps of a simulation. A client that states a
/// shorter step than its simulator has makes every step look like the first one after a gap, so
/// that a body at rest strikes in each step.
class StepIntervals {
 public:
  /// Longest interval, in stated steps, that is one step and no gap: the steps of some games vary.
  static constexpr double kLongestStep = 2.5;

  explicit StepIntervals(double stated_step_s) : stated_step_s_(stated_step_s) {}

  /// Adds the interval before a step, seconds.
  void Add(double interval_s) {
    if (!(interval_s > 0)) return;
    ++count_;
    const double steps = interval_s / stated_step_s_;
    if (!(steps > kLongestStep)) return;
    const double place = std::log(steps / kLongestStep) / std::log(kBinRatio);
    Bin& bin = bins_[static_cast<size_t>(std::min(place, kBinCount - 1.0))];
    ++bin.count;
    bin.sum_s += interval_s;
  }

  /// Returns the usual interval if it is longer than the stated step, which is then probably wrong.
  /// Otherwise returns zero.
  double RegularGapS() const {
    for (size_t i = 0; i + 1 < bins_.size(); ++i) {
      // Intervals that are alike may lie on both sides of the edge between two bins.
      const auto count = bins_[i].count + bins_[i + 1].count;
      if (count >= kEnough && static_cast<double>(count) >= kMost * static_cast<double>(count_)) {
        return (bins_[i].sum_s + bins_[i + 1].sum_s) / static_cast<double>(count);
      }
    }
    return 0;
  }

 private:
  /// A simulation that has contacts in few steps, and sends no others, may have some regular gaps.
  static constexpr uint64_t kEnough = 10;
  /// Share of the intervals that must be alike, because a simulator may miss a step.
  static constexpr double kMost = 0.8;
  /// The bins reach from the longest step to over 100,000 steps.
  static constexpr int kBinCount = 64;
  static constexpr double kBinRatio = 1.2;

  struct Bin {
    uint64_t count = 0;
    double sum_s = 0;
  };

  const double stated_step_s_;
  uint64_t count_ = 0;
  std::array<Bin, kBinCount> bins_{};
};

}  // namespace carillon
