// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/spectra_check.h"

#include <Spectra/MatOp/SparseSymMatProd.h>
#include <Spectra/SymGEigsShiftSolver.h>

#include <Eigen/CholmodSupport>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <stdexcept>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/fem/moving_nodes.h"
#include "precompute/sparse/openblas.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Sparse = SystemMatrices::Sparse;

/// Shift relative to the highest eigenvalue wanted: a tenth of its frequency. Measured: the time
/// does not depend on it within a factor of ten of frequency.
constexpr double kRelativeShift = -0.01;
constexpr double kTolerance = 1e-9;
constexpr int kMaxRestarts = 100;
/// Modes that are looked for beyond those of the model, so that a mode that it lacks is found.
constexpr int kFurtherModes = 2;

/// y = (K - shift M)^-1 x, in the form that Spectra calls.
class ShiftedInverse {
 public:
  using Scalar = double;

  explicit ShiftedInverse(const SystemMatrices& system) : system_(system) {
    cholesky_.cholmod().print = 0;
  }

  Index rows() const { return system_.unknown_count(); }
  Index cols() const { return system_.unknown_count(); }
  void set_shift(double shift) {
    cholesky_.compute(system_.K - shift * system_.M);
    if (cholesky_.info() != Eigen::Success) throw std::runtime_error("K - shift M has no factor");
  }
  void perform_op(const double* x, double* y) const {
    Eigen::Map<Eigen::VectorXd>(y, rows()) =
        cholesky_.solve(Eigen::Map<const Eigen::VectorXd>(x, rows()));
  }

 private:
  const SystemMatrices& system_;
  Eigen::CholmodSupernodalLLT<Sparse, Eigen::Lower> cholesky_;
};

absl::Status NotConverged(int count) {
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat("Spectra's iteration for ", count,
                              " modes did not converge; try a tenth more nodes (--nodes)"));
}

absl::Status TooFewUnknowns(const SystemMatrices& system, int count) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("Spectra cannot find ", count, " modes of ", system.unknown_count(),
                              " unknowns: it needs more unknowns than modes; use more nodes, or a "
                              "lower band"));
}

/// Returns the indices of the system's unknowns among the unknowns of all nodes of the mesh.
std::vector<Index> MovingUnknowns(const TetMesh& mesh) {
  std::vector<Index> unknowns;
  for (const int32_t node : MovingNodes(mesh)) {
    for (Index a = 0; a < 3; ++a) unknowns.push_back(3 * Index{node} + a);
  }
  return unknowns;
}

/// Returns the squared cosine of the largest angle between the spaces that two M-orthonormal bases
/// span.
double SubspaceMac(const MatrixXd& first, const MatrixXd& mass_times_second) {
  const Eigen::JacobiSVD<MatrixXd> svd(first.transpose() * mass_times_second);
  return std::pow(svd.singularValues().minCoeff(), 2);
}

/// Returns the end of the group of close eigenvalues that starts at `begin`.
Index GroupEnd(const Eigen::VectorXd& eigenvalues, Index begin, Index count) {
  Index end = begin + 1;
  while (end < count && eigenvalues[end] < eigenvalues[end - 1] * (1 + kSameEigenvalue)) ++end;
  return end;
}

}  // namespace

std::string SpectraCheck::Text() const {
  if (!failure.empty()) {
    return absl::StrCat("the check with Spectra found no modes to compare: ", failure);
  }
  return absl::StrFormat(
      "checked with Spectra: it found %d modes, of which there are %d here; frequencies differ by "
      "%.2g at most, relatively, and the shapes' modal assurance criterion is 1 - %.2g or more",
      spectra_mode_count, mode_count, largest_frequency_difference, std::max(0.0, 1 - least_mac));
}

absl::StatusOr<Modes> SolveWithSpectra(const SystemMatrices& system, const ModeRequest& request) {
  const auto [count, limit] = request;
  if (count >= system.unknown_count()) return TooFewUnknowns(system, count);
  const int basis_size = std::min(static_cast<int>(system.unknown_count()), 2 * count + 30);
  // Threads gain nothing in a solve of one vector, and wait for each other on a busy machine.
  const ScopedBlasThreads one_thread(1);
  using MassProduct = Spectra::SparseSymMatProd<double, Eigen::Lower>;
  try {
    ShiftedInverse inverse(system);
    MassProduct mass(system.M);
    Spectra::SymGEigsShiftSolver<ShiftedInverse, MassProduct, Spectra::GEigsMode::ShiftInvert>
        lanczos(inverse, mass, count, basis_size, kRelativeShift * limit);
    lanczos.init();
    lanczos.compute(Spectra::SortRule::LargestMagn, kMaxRestarts, kTolerance,
                    Spectra::SortRule::SmallestAlge);
    if (lanczos.info() != Spectra::CompInfo::Successful) return NotConverged(count);
    Modes modes{.eigenvalues = lanczos.eigenvalues(), .shapes = lanczos.eigenvectors()};
    for (Index m = 0; m < modes.shapes.cols(); ++m) {
      auto shape = modes.shapes.col(m);
      shape /= std::sqrt(shape.dot(system.M.selfadjointView<Eigen::Lower>() * shape));
    }
    return modes;
  } catch (const std::bad_alloc&) {
    return Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
                   "the memory does not suffice for Spectra; ask for fewer nodes or a lower band");
  } catch (const std::exception&) {
    return NotConverged(count);
  }
}

SpectraCheck CompareModes(const SystemMatrices& system, const TetMesh& mesh, const Modes& modes,
                          const Modes& spectra) {
  SpectraCheck result{.mode_count = static_cast<int>(modes.eigenvalues.size()),
                      .spectra_mode_count = static_cast<int>(spectra.eigenvalues.size())};
  const Index count = std::min(modes.eigenvalues.size(), spectra.eigenvalues.size());
  for (Index m = 0; m < count; ++m) {
    const double ratio = std::sqrt(spectra.eigenvalues[m] / modes.eigenvalues[m]);
    result.largest_frequency_difference =
        std::max(result.largest_frequency_difference, std::abs(ratio - 1));
  }
  const std::vector<Index> unknowns = MovingUnknowns(mesh);
  for (Index begin = 0; begin < count;) {
    const Index end = GroupEnd(modes.eigenvalues, begin, count);
    const auto group = Eigen::seqN(begin, end - begin);
    const MatrixXd momenta =
        system.M.selfadjointView<Eigen::Lower>() * spectra.shapes(Eigen::all, group);
    result.least_mac =
        std::min(result.least_mac, SubspaceMac(modes.shapes(unknowns, group), momenta));
    begin = end;
  }
  return result;
}

SpectraCheck CheckWithSpectra(const SystemMatrices& system, const TetMesh& mesh,
                              const DeformationModes& solution) {
  const auto rigid_count = static_cast<Index>(solution.verification.rigid_mode_count);
  const auto found = solution.modes.eigenvalues.size();
  const double limit = solution.complete_to_eigenvalue;
  const Index most = std::max<Index>(system.unknown_count() - 1, rigid_count + found);
  const Index wanted = std::min(rigid_count + found + kFurtherModes, most);
  absl::StatusOr<Modes> spectra =
      SolveWithSpectra(system, {.count = static_cast<int>(wanted), .eigenvalue_limit = limit});
  if (!spectra.ok()) {
    SpectraCheck failed;
    failed.failure = ToErrorInfo(spectra.status()).message();
    return failed;
  }
  const Index below = (spectra->eigenvalues.array() < limit).count();
  const Index count = std::max<Index>(below - rigid_count, 0);
  return CompareModes(system, mesh, solution.modes,
                      {.eigenvalues = spectra->eigenvalues.segment(rigid_count, count),
                       .shapes = spectra->shapes.middleCols(rigid_count, count)});
}

}  // namespace carillon::precompute
