// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/verification.h"

namespace carillon::precompute {

Eigen::VectorXd Residuals(const SystemMatrices& system, const Modes& modes) {
  const Eigen::MatrixXd inertial =
      system.M.selfadjointView<Eigen::Lower>() * modes.shapes * modes.eigenvalues.asDiagonal();
  const Eigen::MatrixXd elastic = system.K.selfadjointView<Eigen::Lower>() * modes.shapes;
  return (elastic - inertial).colwise().norm().cwiseQuotient(inertial.colwise().norm());
}

double OrthogonalityError(const SystemMatrices& system, const Eigen::MatrixXd& shapes) {
  if (shapes.cols() == 0) return 0;
  const Eigen::MatrixXd weighted = system.M.selfadjointView<Eigen::Lower>() * shapes;
  Eigen::MatrixXd gram = shapes.transpose() * weighted;
  gram.diagonal().array() -= 1;
  return gram.cwiseAbs().maxCoeff();
}

}  // namespace carillon::precompute
