// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// A step that is still to be done. If a solution misses a mode, all steps but the first, which
/// counts the modes, are repeated.
struct PlannedStep {
  v1::Phase phase;
  double predicted_s = 0;  ///< on the machine on which the cost model was measured
};

/// The predicted time of a round, which makes and solves one mesh, and of the rounds after it,
/// which make finer meshes.
struct RoundForecast {
  double expected_s = 0;    ///< wall time of this round; zero if it is not known
  double later_rounds = 0;  ///< time of all later rounds, as a multiple of this round's time
};

/// Receives the progress of a decomposition. All functions are called in the thread that does the
/// work.
class DecompositionObserver {
 public:
  virtual ~DecompositionObserver() = default;
  /// `fraction` is the estimated part of the phase that is done, 0 to 1.
  virtual void OnProgress(v1::Phase phase, double fraction) = 0;
  /// Called when a round begins, before the next mesh is made and solved.
  virtual void OnRound(const RoundForecast& forecast) = 0;
  /// `steps` are the steps of this round, beginning with the counting of modes. The function is
  /// called again when the prediction becomes more precise.
  virtual void OnPlan(const std::vector<PlannedStep>& steps) = 0;
  /// Called when the mesh file has been read. `extent_m` is the diagonal of the box around the
  /// body.
  virtual void OnExtent(double extent_m) = 0;
  /// Called when the mesh has been made. It has `node_count` nodes, counting corners and mid-side
  /// nodes.
  virtual void OnMesh(size_t node_count) = 0;
  /// Called when the solver has verified `mode_count` modes.
  virtual void OnModes(size_t mode_count) = 0;
};

}  // namespace carillon::precompute
