// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "server/base/clock.h"

namespace carillon {

/// What rendering costs, in units of about a nanosecond of a fast core; how long a unit takes here
/// is learnt while rendering.
namespace work {
inline constexpr double kTimeLane = 6.5;      ///< a lane in the time domain, 128 frames
inline constexpr double kSpectralLane = 6.5;  ///< a lane in a long block
inline constexpr double kStrikeLane = 2;      ///< a strike, each lane
inline constexpr double kMergedLane = 0.8;    ///< a merged strike, each lane
inline constexpr double kVoice = 3000;        ///< a voice, 128 frames
inline constexpr double kTakeStrike = 30;     ///< to take a strike from its stream
inline constexpr double kJudgeStrike = 70;    ///< to keep it until it is due, and to judge it
}  // namespace work

/// How much work a block may have, so that its deadline is kept.
class WorkBudget {
 public:
  /// Without a clock there is no bound. `most_load` is the part of real time that may be used.
  WorkBudget(const Clock* clock, double block_s, double most_load);

  bool bounded() const noexcept { return clock_ != nullptr; }

  /// Units that a block may take.
  double most_work() const noexcept { return most_ns_ / ns_per_unit_; }

  /// Around the rendering of `block_count` blocks, which took so many units.
  void Begin() noexcept;
  void End(double units, double block_count) noexcept;

 private:
  const Clock* clock_;
  double most_ns_;
  double ns_per_unit_ = 1;
  std::chrono::nanoseconds begin_{};
};

}  // namespace carillon
