// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// A step to come. All phases but the first may repeat.
struct PlannedStep {
  v1::Phase phase;
  double predicted_s = 0;  ///< on the machine that predictions are made for
};

/// What is known of a mesh before it is made and solved, and of finer ones after it.
struct RoundForecast {
  double expected_s = 0;    ///< by the clock; zero: not known
  double later_rounds = 0;  ///< what the rounds after it will take, in times of this one
};

/// Told how a decomposition goes on, in the thread that does it.
class DecompositionObserver {
 public:
  virtual ~DecompositionObserver() = default;
  /// `fraction`: estimated part of the phase that is done, 0 to 1.
  virtual void OnProgress(v1::Phase phase, double fraction) = 0;
  /// Another mesh is about to be made and solved.
  virtual void OnRound(const RoundForecast& forecast) = 0;
  /// The steps of this round from the count on; told again once more is known.
  virtual void OnPlan(const std::vector<PlannedStep>& steps) = 0;
  /// The mesh has this many nodes, corners and mid-sides.
  virtual void OnMesh(size_t node_count) = 0;
  /// Verified modes, once known.
  virtual void OnModes(size_t mode_count) = 0;
};

}  // namespace carillon::precompute
