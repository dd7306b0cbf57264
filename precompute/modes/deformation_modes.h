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

namespace carillon::precompute {

/// All verified deformation modes of a body below an eigenvalue. Its rigid-body modes (six, or
/// fewer for a fixed body) are left to the simulator.
struct DeformationModes {
  Modes modes;
  Eigen::VectorXd residuals;  ///< relative, of each mode
  Verification verification;
  double complete_to_eigenvalue = 0;
  /// Modes below the limit that was asked for, as counted or expected, where it was lowered; zero:
  /// it was not.
  int mode_count_below_asked = 0;
  /// The lowest deformation mode, whether below the limit or not.
  double lowest_eigenvalue = 0;
};

/// Largest number of modes of a model. More modes never sound at once, and their shapes would fill
/// gigabytes.
inline constexpr int kMaxModeCount = 5000;
/// Largest number of modes that may be found if only the most audible ones are kept.
inline constexpr int kMaxFoundModeCount = 20'000;

/// The stages of a solution. Counting the modes comes first and belongs to kVerify.
enum class SolveStage { kFactor, kSolve, kVerify };

/// Called with the current stage and the fraction of it that is done, 0 to 1.
using SolveWatch = std::function<void(SolveStage, double)>;

/// The cost above which a solution finds fewer modes.
struct Means {
  size_t bytes = 0;  ///< memory, the matrices included
  double cpu_s = 0;  ///< processor time, as PredictSolveCost() predicts it
};

struct SolveOptions {
  SolverChoice solver = SolverChoice::kBlockLanczos;
  std::vector<Point> held = {};  ///< positions of the fixed nodes
  int max_mode_count = kMaxModeCount;
  /// Present: where all modes below the limit would cost more than these means, or be more than
  /// max_mode_count, the limit is lowered until they do not.
  std::optional<Means> means = {};
  /// Called with the predicted cost before the modes are counted, based on a guess of their number,
  /// and again afterwards.
  std::function<void(const SolveCost&)> on_cost = [](const SolveCost&) {};
};

/// Finds all deformation modes below `eigenvalue_limit`. Their number is counted first, by inertia,
/// so that the solver knows when it has found all of them. If the limit agrees with an eigenvalue
/// to nearly all digits, it is raised slightly.
///
/// `nodes`: positions, in the order of the unknowns.
/// Errors: BODY_IN_SEVERAL_PIECES, TOO_MANY_MODES, MEMORY_TOO_SMALL (before it is taken),
/// OUT_OF_MEMORY, MESH_TOO_LARGE, VERIFICATION_FAILED; with SolverChoice::kSpectra INVALID_SETTINGS
/// (more modes than it can find of so few unknowns).
absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const std::vector<Point>& nodes,
                                                       double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       const SolveOptions& options = {});

/// The same for the body `mesh`, from which Assemble made the matrices. The shapes have all nodes
/// and are zero at fixed nodes.
absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const TetMesh& mesh, double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       SolveOptions options = {});

/// Whether the dense solver is faster, by measurement.
bool PrefersDense(Eigen::Index unknown_count, int mode_count);

}  // namespace carillon::precompute
