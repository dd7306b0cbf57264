// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/poisson_slopes.h"

#include <algorithm>
#include <utility>

#include "precompute/fem/assembly.h"

namespace carillon::precompute {
namespace {

/// Number of modes that are multiplied at a time, which bounds the memory for the products.
constexpr Eigen::Index kModesAtATime = 16;

/// Returns phi^T K phi of each mode, with K for these constants.
Eigen::VectorXd Energies(const TetMesh& mesh, const ElasticConstants& elastic,
                         const Eigen::MatrixXd& shapes) {
  TetMesh free = mesh;
  free.fixed.clear();  // the shapes have rows for fixed nodes, too
  const SystemMatrices::Sparse K = Assemble(free, elastic, 1, MassSharing::kConsistent).K;
  Eigen::VectorXd energies(shapes.cols());
  for (Eigen::Index first = 0; first < shapes.cols(); first += kModesAtATime) {
    const Eigen::Index count = std::min(kModesAtATime, shapes.cols() - first);
    const auto some = shapes.middleCols(first, count);
    const Eigen::MatrixXd forces = K.selfadjointView<Eigen::Lower>() * some;
    energies.segment(first, count) = some.cwiseProduct(forces).colwise().sum().transpose();
  }
  return energies;
}

}  // namespace

Eigen::VectorXd PoissonSlopes(const TetMesh& mesh, const ElasticConstants& elastic,
                              const Modes& modes) {
  if (modes.shapes.cols() == 0) return {};
  const auto [young, nu] = elastic;
  // The energies of the two parts of K follow from those for two ratios, of which the modes' own is
  // one, with Lambda. The other ratio is far enough from it.
  const ElasticConstants other{.young_pa = young, .poisson_ratio = nu < 0.2 ? 0.35 : 0.05};
  const LameConstants own = ToLame(elastic), second = ToLame(other);
  const Eigen::VectorXd energies = Energies(mesh, other, modes.shapes);
  const double determinant = own.lambda_pa * second.mu_pa - second.lambda_pa * own.mu_pa;
  const Eigen::VectorXd by_lambda =
      (second.mu_pa * modes.eigenvalues - own.mu_pa * energies) / determinant;
  const Eigen::VectorXd by_mu =
      (own.lambda_pa * energies - second.lambda_pa * modes.eigenvalues) / determinant;
  const double above = (1 + nu) * (1 - 2 * nu);
  const double lambda_slope = young * (1 + 2 * nu * nu) / (above * above);
  const double mu_slope = -young / (2 * (1 + nu) * (1 + nu));
  return (lambda_slope * by_lambda + mu_slope * by_mu).cwiseQuotient(modes.eigenvalues);
}

}  // namespace carillon::precompute
