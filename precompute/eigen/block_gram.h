// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/eigen/block_basis.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Vectors in blocks of kBlockWidth, all of one length.
using VectorBlocks = std::vector<VectorBlock>;

/// Returns the lower triangle of x^T y, which must be symmetric. The upper triangle of the result
/// is undefined.
Eigen::MatrixXd Gram(const VectorBlocks& x, const VectorBlocks& y, Workers& workers);

/// Computes x := x V. V is square, and has one column for each vector of x.
void Rotate(const Eigen::MatrixXd& V, Workers& workers, VectorBlocks& x);

}  // namespace carillon::precompute
