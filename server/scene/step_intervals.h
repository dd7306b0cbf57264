// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace carillon {

/// The intervals of simulation time between the steps of a simulation. A client that states a
/// shorter step than its simulator has makes every step look like the first one after a gap, so
/// that a body at rest strikes in each step.
class StepIntervals {
 public:
  /// Longest interval, in stated steps, that does not count as a gap. An engine's steps have nearly
  /// the same length.
  static constexpr double kLongestStep = 1.5;

  /// Adds the interval before a step, seconds.
  void Add(double interval_s) {
    if (!(interval_s > 0)) return;
    ++count_;
    shortest_s_ = std::min(shortest_s_, interval_s);
    longest_s_ = std::max(longest_s_, interval_s);
  }

  /// Returns the shortest interval if all intervals are alike and longer than the stated step, by
  /// which the stated step is probably wrong. Otherwise returns zero.
  double RegularGapS(double stated_step_s) const {
    const bool regular = count_ >= kEnough && longest_s_ <= kLongestStep * shortest_s_;
    return regular && shortest_s_ > kLongestStep * stated_step_s ? shortest_s_ : 0;
  }

 private:
  /// A simulation that has contacts in few steps, and sends no others, may have some regular gaps.
  static constexpr uint64_t kEnough = 10;

  uint64_t count_ = 0;
  double shortest_s_ = std::numeric_limits<double>::infinity();
  double longest_s_ = 0;
};

}  // namespace carillon
