// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/eigen/eigensolver.h"
#include "precompute/eigen/solve_cost.h"
#include "precompute/eigen/verification.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/mode_limits.h"
#include "precompute/modes/solution_cost.h"

namespace carillon::precompute {

/// All verified deformation modes of a body below an eigenvalue. Its rigid-body modes (six, or
/// fewer for a fixed body) are left to the simulator.
struct DeformationModes {
  Modes modes;
  Eigen::VectorXd residuals;  ///< relative, of each mode
  Verification verification;
  double complete_to_eigenvalue = 0;
  /// If the limit was lowered, the counted or expected number of modes below the requested limit;
  /// otherwise zero.
  int mode_count_below_asked = 0;
  /// The eigenvalue of the lowest deformation mode, even if it lies above the limit.
  double lowest_eigenvalue = 0;
  /// The lowest deformation mode of a body that has no mode below the limit, otherwise nothing.
  Modes above;
  /// Processor time, s, that PredictSolveCost() predicts for the modes found.
  double predicted_cpu_s = 0;
};

/// The stages of a solution. Counting the modes comes first and belongs to kVerify.
enum class SolveStage { kFactor, kSolve, kVerify };

/// Called with the current stage and the fraction of it that is done, 0 to 1.
using SolveWatch = std::function<void(SolveStage, double)>;

struct SolveOptions {
  std::vector<Point> fixed = {};  ///< positions of the fixed nodes
  int max_mode_count = kMaxModeCount;
  /// If this is set, the limit is lowered until the modes below it cost at most these means and are
  /// at most max_mode_count.
  std::optional<Means> means = {};
  /// Called with the predicted cost, first for a guessed number of modes before the modes are
  /// counted, and again afterwards.
  std::function<void(const SolveCost&)> on_cost = [](const SolveCost&) {};
};

/// Finds all deformation modes below `eigenvalue_limit`. Their number is counted first, by inertia,
/// so that the solver knows when it has found all of them. If the limit agrees with an eigenvalue
/// to nearly all digits, it is raised slightly.
///
/// `nodes` are the positions of the nodes, in the order of the unknowns.
/// Errors: MESH_SEVERAL_PIECES, TOO_MANY_MODES, MEMORY_TOO_SMALL (before memory is allocated),
/// OUT_OF_MEMORY, MESH_TOO_LARGE, VERIFICATION_FAILED.
absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const std::vector<Point>& nodes,
                                                       double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       const SolveOptions& options = {});

/// Finds the same modes for the body `mesh`, from which Assemble made the matrices. The shapes
/// include all nodes and are zero at fixed nodes.
absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const TetMesh& mesh, double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       SolveOptions options = {});

}  // namespace carillon::precompute
