// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/eigen/eigensolver.h"
#include "precompute/eigen/solve_cost.h"
#include "precompute/eigen/verification.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Every deformation mode of a body below an eigenvalue, verified; its rigid-body modes (six, fewer
/// where it is held) are left to the simulator.
struct DeformationModes {
  Modes modes;
  Eigen::VectorXd residuals;  ///< relative, of each mode
  Verification verification;
  double complete_to_eigenvalue = 0;
  /// The lowest deformation mode, whether below the limit or not.
  double lowest_eigenvalue = 0;
};

/// More modes than this are refused: as many never sound at once, and their shapes fill gigabytes.
inline constexpr int kMaxModeCount = 5000;
/// As many may be found where only the most audible are kept.
inline constexpr int kMaxFoundModeCount = 20'000;

/// What a solution is at: it counts the modes first, which belongs to their proof.
enum class SolveStage { kFactor, kSolve, kVerify };

/// Told of every stage and of the part of it that is done, 0 to 1.
using SolveWatch = std::function<void(SolveStage, double)>;

struct SolveOptions {
  std::vector<Point> held = {};  ///< of the nodes that are held
  int max_mode_count = kMaxModeCount;
  /// Told of the cost before the modes are counted, from a guess of their number, and after.
  std::function<void(const SolveCost&)> on_cost = [](const SolveCost&) {};
};

/// Finds all deformation modes below `eigenvalue_limit`. Their number is counted first, by inertia,
/// so that the solver knows when it has them all; where the limit agrees with an eigenvalue to
/// nearly all digits it is raised by a hair.
///
/// `nodes`: positions, in the order of the unknowns.
/// Errors: BODY_IN_SEVERAL_PIECES, TOO_MANY_MODES, MEMORY_TOO_SMALL (before it is taken),
/// OUT_OF_MEMORY, MESH_TOO_LARGE, VERIFICATION_FAILED.
absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const std::vector<Point>& nodes,
                                                       double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       const SolveOptions& options = {});

/// The same of the body whose matrices Assemble made, which says what is held; the shapes have all
/// its nodes, and are zero where they are held.
absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const TetMesh& mesh, double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       SolveOptions options = {});

/// True where the dense solver is the faster one, by measurement.
bool PrefersDense(Eigen::Index unknown_count, int mode_count);

}  // namespace carillon::precompute
