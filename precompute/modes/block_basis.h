// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/modes/block_kernels.h"
#include "precompute/modes/node_matrix.h"

namespace carillon::precompute {

/// kBlockWidth vectors as the kernels take them: a row an unknown, in elimination order.
using VectorBlock = Eigen::Matrix<double, Eigen::Dynamic, kBlockWidth, Eigen::RowMajor>;
using SmallBlock = Eigen::Matrix<double, kBlockWidth, kBlockWidth, Eigen::RowMajor>;

/// Vectors in blocks: the Q of a block Krylov method.
class BlockBasis {
 public:
  explicit BlockBasis(Eigen::Index rows) : rows_(rows) {}

  void Append(const VectorBlock& block) { blocks_.push_back(block); }
  int size() const { return static_cast<int>(blocks_.size()) * kBlockWidth; }
  const VectorBlock& back(size_t before) const { return blocks_[blocks_.size() - 1 - before]; }

  /// Q^T x
  Eigen::MatrixXd Project(const VectorBlock& x) const {
    Eigen::MatrixXd h(size(), kBlockWidth);
    for (size_t b = 0; b < blocks_.size(); ++b) {
      h.middleRows(static_cast<Eigen::Index>(b) * kBlockWidth, kBlockWidth) = Dot(blocks_[b], x);
    }
    return h;
  }

  /// x -= Q h
  void Subtract(const Eigen::MatrixXd& h, VectorBlock& x) const {
    for (size_t b = 0; b < blocks_.size(); ++b) {
      const SmallBlock part = h.middleRows(static_cast<Eigen::Index>(b) * kBlockWidth, kBlockWidth);
      BlockSubtractTimes(blocks_[b].data(), part.data(), rows_, x.data());
    }
  }

  /// Q s
  Eigen::MatrixXd Combine(const Eigen::MatrixXd& s) const {
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(rows_, s.cols());
    for (size_t b = 0; b < blocks_.size(); ++b) {
      x.noalias() +=
          blocks_[b] * s.middleRows(static_cast<Eigen::Index>(b) * kBlockWidth, kBlockWidth);
    }
    return x;
  }

  static SmallBlock Dot(const VectorBlock& a, const VectorBlock& b) {
    SmallBlock result;
    BlockDot(a.data(), b.data(), a.rows(), result.data());
    return result;
  }

 private:
  Eigen::Index rows_;
  std::vector<VectorBlock> blocks_;
};

}  // namespace carillon::precompute
