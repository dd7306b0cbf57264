// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "precompute/decomposition_observer.h"

namespace carillon::precompute {

/// How long a decomposition will take yet: the work predicted of each step to come, at the speed
/// measured of those done. Knows no clock: every time is given, in seconds from the beginning.
class RemainingTime {
 public:
  /// Another mesh is about to be made and solved.
  void BeginRound(double now_s, const RoundForecast& forecast);
  /// The steps of this round after its matrices, as far as they are not done yet.
  void Plan(double now_s, std::vector<PlannedStep> steps);
  /// `fraction` of the phase is done, 0 to 1; zero also where nobody knows.
  void Progress(double now_s, v1::Phase phase, double fraction);

  /// Nothing where neither a plan nor a forecast is there.
  std::optional<double> Seconds(double now_s) const;

 private:
  const PlannedStep* current() const { return step_ < steps_.size() ? &steps_[step_] : nullptr; }
  void Go(double now_s, size_t step);
  /// Seconds that a predicted second takes.
  double Slowness() const;
  double ThisRound(double now_s) const;

  RoundForecast forecast_;
  double round_begun_s_ = 0;
  std::vector<PlannedStep> steps_;
  size_t step_ = 0;  ///< the one under way; with no plan, or before its first one, none
  bool under_way_ = false;
  double step_begun_s_ = 0;
  double fraction_ = 0;  ///< as last reported, and when
  double reported_s_ = 0;
  double done_s_ = 0;       ///< measured, of all steps done, in earlier rounds too
  double predicted_s_ = 0;  ///< of the same
};

}  // namespace carillon::precompute
