// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/eigen/block_basis.h"
#include "precompute/eigen/eigensolver.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The results of verifying a set of deformation modes.
struct Verification {
  /// Largest |K phi - Lambda M phi| / |Lambda M phi|, Euclidean.
  double max_residual = 0;
  /// Largest |phi_i^T M phi_j - delta_ij|, rigid-body modes included.
  double max_orthogonality_error = 0;
  int rigid_mode_count = 0;
  /// Number of eigenvalues below sturm_eigenvalue by inertia. It must equal rigid_mode_count plus
  /// the number of modes found.
  int sturm_count = 0;
  double sturm_eigenvalue = 0;
};

/// A mode whose residual is above this limit and above the rounding error is refused. The relative
/// error of an eigenvalue is of the order of the residual squared.
inline constexpr double kMaxResidual = 1e-5;
inline constexpr double kMaxOrthogonalityError = 1e-7;

/// Largest value of ResidualOfRounding().
inline constexpr double kMostRounding = 1e-3;

/// Returns the residual that an exact mode has because of rounding. The product with K has an error
/// relative to its stiffest node, which on a slender body is 1e12 times as stiff as the lowest
/// mode. The result is at most kMostRounding.
double ResidualOfRounding(double stiffest, double eigenvalue);

/// Returns the largest ratio K_ii / M_ii of the diagonal entries.
double StiffestNode(const NodeMatrix& A);

/// Measured properties of modes.
struct Measurement {
  Eigen::VectorXd residuals;  ///< |K phi - Lambda M phi| / |Lambda M phi| of each deformation mode
  Eigen::MatrixXd gram;       ///< phi_i^T M phi_j
};

/// Measures the residuals and the Gram matrix of modes. `order` is the order of the nodes in A, see
/// MakeNodeMatrix.
Measurement Measure(const NodeMatrix& A, const std::vector<int32_t>& order, const Modes& modes,
                    Workers& workers);

/// Returns the largest |gram_ij - delta_ij|.
double OrthogonalityError(const Eigen::MatrixXd& gram);

/// A number for each vector of a block.
using BlockRow = Eigen::Array<double, 1, kBlockWidth>;

/// Returns |D^1/2 (elastic - inertial Lambda)| / |D^1/2 inertial Lambda| for each vector x, where
/// elastic = K x and inertial = M x. D^1/2 converts the products to the user's unknowns.
BlockRow RelativeResiduals(const NodeMatrix& A, const VectorBlock& elastic,
                           const VectorBlock& inertial, const BlockRow& eigenvalues);

}  // namespace carillon::precompute
