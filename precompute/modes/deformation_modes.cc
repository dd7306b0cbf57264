// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/deformation_modes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "precompute/eigen/block_lanczos_eigensolver.h"
#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/fem/moving_nodes.h"
#include "precompute/mesh/point_math.h"
#include "precompute/modes/lower_limit.h"
#include "precompute/modes/rigid_body.h"
#include "precompute/modes/shape_signs.h"
#include "precompute/modes/solution_cost.h"
#include "precompute/modes/solution_refusals.h"
#include "precompute/sparse/dense_blas.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/multifrontal_inertia.h"
#include "precompute/sparse/openblas.h"
#include "precompute/sparse/workers.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Number of attempts to find all modes that were counted; each attempt searches for more vectors
/// than the one before.
constexpr int kMaxAttempts = 3;

/// A mode with an eigenvalue below this fraction of the limit, and within the rounding error of the
/// stiffest node, is a rigid-body mode.
constexpr double kFreeMotion = 1e-9;
constexpr double kRounding = 1e-12;

/// Keeps the modes with these indices (ascending). Works in place, because shapes fill gigabytes.
void Keep(const std::vector<Eigen::Index>& which, Modes& modes) {
  for (size_t k = 0; k < which.size(); ++k) {
    const auto to = static_cast<Eigen::Index>(k);
    if (which[k] == to) continue;
    modes.eigenvalues[to] = modes.eigenvalues[which[k]];
    modes.shapes.col(to) = modes.shapes.col(which[k]);
  }
  const auto count = static_cast<Eigen::Index>(which.size());
  modes.eigenvalues.conservativeResize(count);
  modes.shapes.conservativeResize(Eigen::NoChange, count);
}

int GuessModeCount(const SystemMatrices& system, double limit) {
  return static_cast<int>(std::min<double>(WeylModeCount(system, limit), kMaxFoundModeCount));
}

/// Number of modes that are found whatever their cost, as long as there is memory for them.
constexpr int kAlwaysAffordable = 30;

/// One solution: it counts the modes, solves for them and verifies them.
class Solution {
 public:
  Solution(const SystemMatrices& system, OrderedSystem ordered, const std::vector<Point>& nodes,
           const SolveWatch& watch, const SolveOptions& options)
      : system_(system),
        nodes_(nodes),
        options_(options),
        watch_(watch),
        ordered_(std::move(ordered)),
        rigid_(RigidBodyModes(nodes, system, options.fixed)),
        rigid_momenta_(system.M.selfadjointView<Eigen::Lower>() * rigid_),
        workers_(ThreadCount()) {}

  int rigid_mode_count() const { return static_cast<int>(rigid_.cols()); }

  absl::StatusOr<int> CountBelow(double limit) const {
    options_.on_cost(Cost(rigid_mode_count() + GuessModeCount(system_, limit)));
    watch_(SolveStage::kVerify, 0);
    absl::StatusOr<int> count =
        CountEigenvaluesBelow(ordered_.fronts, ordered_.matrix, limit, workers_,
                              [this](double done) { watch_(SolveStage::kVerify, done); });
    if (!count.ok()) return count;
    if (*count < rigid_mode_count()) {
      return VerificationFailed(absl::StrCat("only ", *count, " of the ", rigid_mode_count(),
                                             " rigid-body modes lie below "
                                             "the limit"));
    }
    return count;
  }

  /// Returns the number of modes that is expected below the limit, independent of the mesh. It is
  /// rarely too high.
  int ExpectedCount(double limit) const {
    return rigid_mode_count() +
           static_cast<int>(std::min(WeylModeCount(system_, limit), kMostExpectedModes));
  }

  int unknown_count() const { return static_cast<int>(system_.unknown_count()); }

  /// Returns whether the limit may be lowered so that fewer than `count` modes lie below it.
  bool MayLowerLimit(int count) const {
    return options_.means.has_value() && count > MostAffordable();
  }

  /// Checks the number of modes, rigid-body ones included.
  absl::Status CheckCount(int count) const {
    const int found = count - rigid_mode_count();
    if (found > options_.max_mode_count) return TooManyModes(found, options_.max_mode_count);
    return absl::OkStatus();
  }

  /// Returns the largest number of modes, rigid-body ones included, that the options allow.
  int MostModes() const { return rigid_mode_count() + options_.max_mode_count; }

  /// Returns the largest number of modes, rigid-body ones included, that the means allow.
  int MostAffordable() const {
    return LargestThat(rigid_mode_count() + kAlwaysAffordable, MostModes(),
                       [this](int count) { return Afford(*options_.means, Cost(count)); });
  }

  absl::StatusOr<Modes> SolveLowest(int count, double limit) const {
    const SolveCost cost = Cost(count);
    RETURN_IF_ERROR(CheckMemory(cost));
    options_.on_cost(cost);
    watch_(IsDense(count) ? SolveStage::kSolve : SolveStage::kFactor, 0);
    const ModeRequest request{
        .count = static_cast<int>(std::min<Eigen::Index>(count, system_.unknown_count())),
        .eigenvalue_limit = limit};
    return MakeSolver(request.count)->Solve(system_, request, [this](double done) {
      watch_(SolveStage::kSolve, done);
    });
  }

  /// Returns the refusal, or one that names the slenderness of the body if that is the cause.
  absl::Status Explained(absl::Status refusal) const {
    if (refusal.ok()) return refusal;
    return NamingSlenderness(std::move(refusal), {.lowest_eigenvalue = BoundOfLowest(),
                                                  .stiffest = StiffestNode(ordered_.matrix),
                                                  .extent_m = Diagonal(nodes_)});
  }

  /// Returns a bound above which few or none of the eigenvalues lie.
  double BoundOfHighest() const { return 4 * StiffestNode(ordered_.matrix); }

  /// Returns an upper bound near the lowest deformation eigenvalue.
  double BoundOfLowest() const { return LowestEigenvalueBound(nodes_, system_, options_.fixed); }

  /// Removes the rigid-body modes, and makes all checks except the one for completeness.
  absl::StatusOr<DeformationModes> Verify(Modes all, double limit) const {
    watch_(SolveStage::kVerify, 0);
    DeformationModes result;
    result.predicted_cpu_s = Cost(static_cast<int>(all.shapes.cols())).cpu_seconds();
    const Measurement measured = Measure(ordered_.matrix, ordered_.fronts.order, all, workers_);
    result.verification.max_orthogonality_error = OrthogonalityError(measured.gram);
    std::vector<Eigen::Index> kept;
    const Eigen::MatrixXd in_rigid = InRigid(all.shapes);
    for (Eigen::Index m = 0; m < all.shapes.cols(); ++m) {
      if (in_rigid.col(m).squaredNorm() < 0.5) kept.push_back(m);
    }
    result.verification.rigid_mode_count =
        static_cast<int>(all.shapes.cols()) - static_cast<int>(kept.size());
    const Eigen::Index free_motions = (all.eigenvalues.array() < FreeMotionBound(limit)).count();
    if (free_motions > rigid_mode_count()) {
      return SeveralPieces(static_cast<int>(free_motions), rigid_mode_count(),
                           !options_.fixed.empty());
    }
    Keep(kept, all);
    result.modes = std::move(all);
    FixSigns(result.modes.shapes);
    result.residuals = measured.residuals(kept);
    if (!kept.empty()) {
      result.lowest_eigenvalue = result.modes.eigenvalues[0];
      result.verification.max_residual = result.residuals.maxCoeff();
    }
    RETURN_IF_ERROR(Check(result.verification));
    RETURN_IF_ERROR(CheckResiduals(result));
    return result;
  }

 private:
  bool IsDense(int count) const { return PrefersDense(system_.unknown_count(), count); }

  SolveCost Cost(int count) const { return CostOfSolution(ordered_, count); }

  std::unique_ptr<Eigensolver> MakeSolver(int count) const {
    if (IsDense(count)) return std::make_unique<DenseEigensolver>();
    return std::make_unique<BlockLanczosEigensolver>(ordered_, rigid_);
  }

  /// Returns the components of shapes along the rigid-body modes, #rigid by #shapes.
  Eigen::MatrixXd InRigid(const Eigen::MatrixXd& shapes) const {
    const auto rows = static_cast<int>(shapes.rows());
    const int rigid = rigid_mode_count();
    const auto count = static_cast<int>(shapes.cols());
    Eigen::MatrixXd parts(rigid, count);
    if (parts.size() == 0) return parts;
    blas::TransposedProduct(rigid, count, rows, rigid_momenta_.data(), rows, shapes.data(), rows,
                            parts.data(), rigid);
    return parts;
  }

  double FreeMotionBound(double limit) const {
    return std::min(kFreeMotion * limit, kRounding * StiffestNode(ordered_.matrix));
  }

  absl::Status CheckResiduals(const DeformationModes& result) const {
    const double stiffest = StiffestNode(ordered_.matrix);
    for (Eigen::Index m = 0; m < result.residuals.size(); ++m) {
      const double rounding = ResidualOfRounding(stiffest, result.modes.eigenvalues[m]);
      const double most = std::max(kMaxResidual, rounding);
      if (result.residuals[m] <= most) continue;
      return VerificationFailed(
          absl::StrCat("a mode has the relative residual ", result.residuals[m], ", above ", most));
    }
    return absl::OkStatus();
  }

  absl::Status Check(const Verification& proof) const {
    if (proof.rigid_mode_count != rigid_mode_count()) {
      return VerificationFailed(absl::StrCat(
          proof.rigid_mode_count, " rigid-body modes were found, not ", rigid_mode_count()));
    }
    if (!(proof.max_orthogonality_error <= kMaxOrthogonalityError)) {
      return VerificationFailed(absl::StrCat("two modes are orthogonal only to ",
                                             proof.max_orthogonality_error, ", not to ",
                                             kMaxOrthogonalityError));
    }
    return absl::OkStatus();
  }

  const SystemMatrices& system_;
  const std::vector<Point>& nodes_;
  const SolveOptions& options_;
  const SolveWatch& watch_;
  OrderedSystem ordered_;
  Eigen::MatrixXd rigid_;
  Eigen::MatrixXd rigid_momenta_;  ///< M times rigid_
  mutable Workers workers_;
};

/// Counts the modes below the limit, or below a lower limit if all of the modes would cost too
/// much. The modes below the requested limit are not counted if far too many are expected.
absl::StatusOr<Counted> CountAffordable(const Solution& solution, double limit) {
  constexpr int kFarTooMany = 4;
  const int expected = solution.ExpectedCount(limit);
  Counted counted{limit, expected, expected};
  if (!solution.MayLowerLimit(std::min(expected, solution.unknown_count()) / kFarTooMany)) {
    ASSIGN_OR_RETURN(const int count, solution.CountBelow(limit));
    counted = {limit, count, count};
  }
  if (solution.MayLowerLimit(counted.count)) {
    ASSIGN_OR_RETURN(counted, LowerLimit(counted, solution.MostAffordable(),
                                         [&](double lower) { return solution.CountBelow(lower); }));
  }
  absl::Status status = solution.CheckCount(counted.count);
  if (status.ok()) return counted;
  const int most = solution.MostModes();
  counted.limit = std::min(counted.limit, solution.BoundOfHighest());
  const absl::StatusOr<Counted> fewer =
      LowerLimit(counted, most, [&](double lower) { return solution.CountBelow(lower); });
  return WithLowerLimit(std::move(status), solution.unknown_count(), fewer, most);
}

/// Handles a body without a mode below the limit: finds its lowest mode with one more
/// factorization.
absl::StatusOr<DeformationModes> FindLowest(const Solution& solution, double limit) {
  const double above = solution.BoundOfLowest();
  ASSIGN_OR_RETURN(Modes lowest, solution.SolveLowest(solution.rigid_mode_count() + 1, above));
  ASSIGN_OR_RETURN(DeformationModes result, solution.Verify(std::move(lowest), above));
  result.above = std::exchange(result.modes, {});
  result.residuals.resize(0);
  result.complete_to_eigenvalue = limit;
  return result;
}

/// Counts, finds and verifies the modes, several times if necessary.
absl::StatusOr<DeformationModes> Solve(const Solution& solution, double eigenvalue_limit) {
  absl::Status failure;
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    const absl::StatusOr<Counted> counted =
        CountAffordable(solution, eigenvalue_limit * (1 + 1e-4 * attempt));
    if (absl::IsInternal(counted.status())) {  // the limit may lie on an eigenvalue
      failure = counted.status();
      continue;
    }
    if (!counted.ok()) return counted.status();
    const auto [limit, count, asked_count] = *counted;
    if (count == solution.rigid_mode_count()) return FindLowest(solution, limit);
    ASSIGN_OR_RETURN(Modes all, solution.SolveLowest(count + 4 * attempt, limit));
    std::vector<Eigen::Index> below(static_cast<size_t>((all.eigenvalues.array() < limit).count()));
    std::iota(below.begin(), below.end(), 0);
    if (static_cast<int>(below.size()) != count) {
      failure =
          VerificationFailed("not all modes that were counted below the limit could be found");
      continue;
    }
    Keep(below, all);
    ASSIGN_OR_RETURN(DeformationModes result, solution.Verify(std::move(all), limit));
    result.verification.sturm_count = count;
    result.verification.sturm_eigenvalue = limit;
    result.complete_to_eigenvalue = limit;
    if (count < asked_count) {
      result.mode_count_below_asked = asked_count - solution.rigid_mode_count();
    }
    return result;
  }
  return failure;
}

}  // namespace

absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const std::vector<Point>& nodes,
                                                       double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       const SolveOptions& options) {
  ASSIGN_OR_RETURN(OrderedSystem ordered, OrderedSystem::Make(system));
  RETURN_IF_ERROR(CheckMemory(PredictSolveCost(ordered, 1, ThreadCount())));
  const Solution solution(system, std::move(ordered), nodes, watch, options);
  absl::StatusOr<DeformationModes> result = Solve(solution, eigenvalue_limit);
  if (!result.ok()) return solution.Explained(result.status());
  return result;
}

absl::StatusOr<DeformationModes> SolveDeformationModes(const SystemMatrices& system,
                                                       const TetMesh& mesh, double eigenvalue_limit,
                                                       const SolveWatch& watch,
                                                       SolveOptions options) {
  options.fixed = PlacesOf(mesh.fixed, mesh);
  if (mesh.fixed.empty()) {
    return SolveDeformationModes(system, mesh.nodes, eigenvalue_limit, watch, options);
  }
  const std::vector<int32_t> moving = MovingNodes(mesh);
  ASSIGN_OR_RETURN(
      DeformationModes result,
      SolveDeformationModes(system, PlacesOf(moving, mesh), eigenvalue_limit, watch, options));
  for (Modes* modes : {&result.modes, &result.above}) {
    modes->shapes = Extended(modes->shapes, moving, mesh.nodes.size());
  }
  return result;
}

}  // namespace carillon::precompute
