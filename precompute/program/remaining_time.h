// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "precompute/pipeline/decomposition_observer.h"

namespace carillon::precompute {

/// Estimates how long a decomposition will still take. The estimate is the predicted time of each
/// remaining step, scaled by the speed measured in the finished steps. The class reads no clock:
/// callers pass every time, in seconds since the start.
class RemainingTime {
 public:
  /// Called before another mesh is made and solved.
  void BeginRound(double now_s, const RoundForecast& forecast);
  /// Sets the steps of this round that follow the assembly of the matrices. A later call replaces
  /// them.
  void Plan(double now_s, std::vector<PlannedStep> steps);
  /// Reports that `fraction` of the phase is done, 0 to 1. An unknown fraction is zero.
  void Progress(double now_s, v1::Phase phase, double fraction);

  /// Returns the remaining time, or nothing if there is neither a plan nor a forecast.
  std::optional<double> Seconds(double now_s) const;

 private:
  const PlannedStep* current() const { return step_ < steps_.size() ? &steps_[step_] : nullptr; }
  void Go(double now_s, size_t step);
  /// Returns the ratio of measured to predicted time.
  double Slowness() const;
  double ThisRound(double now_s) const;

  RoundForecast forecast_;
  double round_begun_s_ = 0;
  std::vector<PlannedStep> steps_;
  size_t step_ = 0;  ///< the current step, if under_way_
  bool under_way_ = false;
  double step_begun_s_ = 0;
  double fraction_ = 0;  ///< the last reported fraction, and the time of that report
  double reported_s_ = 0;
  double done_s_ = 0;       ///< measured time of all finished steps, including earlier rounds
  double predicted_s_ = 0;  ///< predicted time of the same steps
};

}  // namespace carillon::precompute
