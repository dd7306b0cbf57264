// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "server/base/clock.h"

namespace carillon {

/// Costs of rendering, in units of work. One unit takes about a nanosecond on a fast core;
/// WorkBudget measures how long it takes on this machine.
namespace work {
inline constexpr double kTimeLane = 6.5;      ///< a lane in the time domain, for 128 frames
inline constexpr double kSpectralLane = 6.5;  ///< a lane in a long block
inline constexpr double kStrikeLane = 2;      ///< an exact impulse, for each lane of its bank
inline constexpr double kStrike = 120;        ///< an exact impulse, apart from its lanes
inline constexpr double kMergedStrike = 60;   ///< a merged impulse, apart from its lanes
inline constexpr double kMergedLane = 0.8;    ///< a merged impulse, for each lane of its bank
inline constexpr double kDirectedTerm = 1;    ///< a term of the gains of directed modes
inline constexpr double kVoice = 3000;        ///< a voice, for 128 frames
inline constexpr double kMovingVoice = 300;   ///< a silent voice that moves, for 128 frames
inline constexpr double kEars = 12000;        ///< the two ears of a voice, for 128 frames
inline constexpr double kTakeEvent = 30;      ///< taking an event from its stream
inline constexpr double kChooseEvent =
    70;  ///< keeping an event until it is due, and choosing its treatment
}  // namespace work

/// Bounds the work of a block so that the block is rendered before its deadline.
class WorkBudget {
 public:
  /// If `clock` is null, the work is unbounded. `most_load` is the fraction of real time that
  /// rendering may use.
  WorkBudget(const Clock* clock, double block_s, double most_load);

  bool bounded() const noexcept { return clock_ != nullptr; }

  /// Returns the units of work that a block may take.
  double most_work() const noexcept { return most_ns_ / ns_per_unit_; }

  /// Begin and End enclose the rendering of `block_count` blocks, which took `units` of work in
  /// total; their duration updates the measured time of a unit.
  void Begin() noexcept;
  void End(double units, double block_count) noexcept;

 private:
  const Clock* clock_;
  double most_ns_;
  double ns_per_unit_ = 1;
  std::chrono::nanoseconds begin_{};
};

}  // namespace carillon
