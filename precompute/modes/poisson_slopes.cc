// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/poisson_slopes.h"

#include <Eigen/LU>
#include <algorithm>
#include <span>

#include "precompute/fem/assembly.h"
#include "precompute/fem/curved_element.h"
#include "precompute/fem/tet_rule.h"
#include "precompute/mesh/curved_edges.h"
#include "precompute/modes/mode_rows.h"
#include "precompute/modes/patch_kernels.h"

namespace carillon::precompute {
namespace {

/// The gradients of the functions of an element's nodes at a point, a column for each.
using Gradients = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 10>;

/// Calls use(volume, gradients) for each point of a rule over an element that is exact for the
/// square of the divergence, with the part of the volume for which the point stands.
template <typename Use>
void ForEachPoint(const TetMesh& mesh, size_t e, const Use& use) {
  if (IsCurved(mesh, e)) {
    const TenNodes nodes = NodesOf(mesh, e);
    for (const TetRulePoint& point : TetRuleOfDegree5()) {
      const Eigen::Matrix<double, 10, 3> own =
          QuadraticGradients(ReferenceGradients(), point.barycentric);
      const Eigen::Matrix3d jacobian = nodes * own;
      use(point.weight / 6 * jacobian.determinant(),
          Gradients((own * jacobian.inverse()).transpose()));
    }
    return;
  }
  const TetGeometry geometry = GeometryOf(mesh, e);
  if (mesh.nodes_per_element == 4) {
    use(geometry.volume_m3, Gradients(geometry.gradients.transpose()));
    return;
  }
  for (int k = 0; k < 4; ++k) {  // the rule of four points is exact for quadratics
    Eigen::Vector4d at = Eigen::Vector4d::Constant(0.13819660112501051518);
    at[k] = 0.58541019662496845446;
    use(geometry.volume_m3 / 4, Gradients(QuadraticGradients(geometry.gradients, at).transpose()));
  }
}

/// Returns phi^T K_l phi of each mode, which is the integral of the square of its divergence.
Eigen::VectorXd SquaredDivergences(const TetMesh& mesh, const Modes& modes) {
  Eigen::VectorXd squares(modes.eigenvalues.size());
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  for (Eigen::Index first = 0; first < squares.size(); first += ModeRows::kAtATime) {
    const Eigen::Index count = std::min(ModeRows::kAtATime, squares.size() - first);
    const ModeRows some(modes, first, count);
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(some.rows().mode_count);
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      const auto nodes = std::span(mesh.elements).subspan(e * stride, stride);
      ForEachPoint(mesh, e, [&](double volume_m3, const Gradients& gradients) {
        AddSquaredDivergences(nodes, gradients.data(), volume_m3, some.rows(), sums.data());
      });
    }
    squares.segment(first, count) = sums.head(count);
  }
  return squares;
}

}  // namespace

Eigen::VectorXd PoissonSlopes(const TetMesh& mesh, const ElasticConstants& elastic,
                              const Modes& modes) {
  const auto [young, nu] = elastic;
  const LameConstants lame = ToLame(elastic);
  const Eigen::VectorXd by_lambda = SquaredDivergences(mesh, modes);
  const Eigen::VectorXd by_mu = (modes.eigenvalues - lame.lambda_pa * by_lambda) / lame.mu_pa;
  const double above = (1 + nu) * (1 - 2 * nu);
  const double lambda_slope = young * (1 + 2 * nu * nu) / (above * above);
  const double mu_slope = -young / (2 * (1 + nu) * (1 + nu));
  return (lambda_slope * by_lambda + mu_slope * by_mu).cwiseQuotient(modes.eigenvalues);
}

}  // namespace carillon::precompute
