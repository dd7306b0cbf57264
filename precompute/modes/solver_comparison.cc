// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/solver_comparison.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/fem/held_nodes.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

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

std::string SolverComparison::Text() const {
  if (!failure.empty()) {
    return absl::StrCat("the check with ", solver, " found no modes to compare: ", failure);
  }
  return absl::StrFormat(
      "checked with %s: it found %d modes, of which there are %d here; frequencies differ by %.2g "
      "at most, relatively, and the shapes' modal assurance criterion is 1 - %.2g or more",
      solver, other_mode_count, mode_count, largest_frequency_difference,
      std::max(0.0, 1 - least_mac));
}

SolverComparison CompareSolutions(const SystemMatrices& system, const TetMesh& mesh,
                                  const Modes& first, const Modes& second) {
  SolverComparison result;
  result.mode_count = static_cast<int>(first.eigenvalues.size());
  result.other_mode_count = static_cast<int>(second.eigenvalues.size());
  const Index count = std::min(first.eigenvalues.size(), second.eigenvalues.size());
  const std::vector<Index> unknowns = MovingUnknowns(mesh);
  for (Index m = 0; m < count; ++m) {
    const double ratio = std::sqrt(second.eigenvalues[m] / first.eigenvalues[m]);
    result.largest_frequency_difference =
        std::max(result.largest_frequency_difference, std::abs(ratio - 1));
  }
  for (Index begin = 0; begin < count;) {
    const Index end = GroupEnd(first.eigenvalues, begin, count);
    const auto group = Eigen::seqN(begin, end - begin);
    const MatrixXd other = second.shapes(unknowns, group);
    const MatrixXd momenta = system.M.selfadjointView<Eigen::Lower>() * other;
    result.least_mac =
        std::min(result.least_mac, SubspaceMac(first.shapes(unknowns, group), momenta));
    begin = end;
  }
  return result;
}

}  // namespace carillon::precompute
