// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/eigen/block_basis.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Vectors in blocks of kBlockWidth, all of one length.
using VectorBlocks = std::vector<VectorBlock>;

/// x^T y where that is symmetric: its lower triangle, the upper one is zero or anything.
Eigen::MatrixXd Gram(const VectorBlocks& x, const VectorBlocks& y, Workers& workers);

/// x := x V, V square of as many columns as x has vectors.
void Rotate(const Eigen::MatrixXd& V, Workers& workers, VectorBlocks& x);

}  // namespace carillon::precompute
