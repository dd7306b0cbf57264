// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "precompute/sparse/block_kernels.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

using SmallBlock = Eigen::Matrix<double, kBlockWidth, kBlockWidth, Eigen::RowMajor>;
template <typename Real>
using SmallBlockOf = Eigen::Matrix<Real, kBlockWidth, kBlockWidth, Eigen::RowMajor>;

/// kBlockWidth vectors in the kernels' layout: one row for each unknown, in elimination order.
template <typename Real>
using VectorBlockOf = Eigen::Matrix<Real, Eigen::Dynamic, kBlockWidth, Eigen::RowMajor>;
using VectorBlock = VectorBlockOf<double>;

/// The coefficients of a block with respect to the blocks of a basis, in the order of the basis.
using Coefficients = std::vector<SmallBlock>;

/// The basis Q of a block Krylov method, stored in blocks of vectors. Products process a stretch of
/// rows for all blocks before the next stretch. A stretch fits into the first-level cache, so that
/// the basis is read once.
template <typename Real>
class BlockBasis {
 public:
  using Block = VectorBlockOf<Real>;

  BlockBasis(Eigen::Index rows, Workers& workers) : rows_(rows), workers_(workers) {}

  void Append(Block block) { blocks_.push_back(std::make_unique<Block>(std::move(block))); }
  /// Returns the block that was appended `before` blocks before the last one.
  const Block& back(size_t before) const { return *blocks_[blocks_.size() - 1 - before]; }
  int size() const { return static_cast<int>(blocks_.size()) * kBlockWidth; }

  /// Returns Q^T x.
  Coefficients Project(const Block& x) const {
    std::vector<Coefficients> parts(static_cast<size_t>(workers_.count()));
    workers_.ForParts(rows_, kStretch, [&](int64_t begin, int64_t end, int t) {
      parts[static_cast<size_t>(t)] = ProjectRows(x, begin, end);
    });
    for (size_t t = 1; t < parts.size(); ++t) {
      for (size_t b = 0; b < parts[t].size(); ++b) parts[0][b] += parts[t][b];
    }
    return std::move(parts[0]);
  }

  /// Computes x -= q h for the block q = back(before).
  void SubtractBlock(size_t before, const SmallBlock& h, Block& x) const {
    SmallBlockOf<Real> rounded;
    rounded = h.template cast<Real>();
    workers_.ForParts(rows_, kStretch, [&](int64_t begin, int64_t end, int) {
      BlockSubtractTimes(At(back(before), begin), rounded.data(), end - begin, At(x, begin));
    });
  }

  /// Returns a^T b.
  static SmallBlock Dot(const Block& a, const Block& b, Workers& workers) {
    std::vector<SmallBlock> parts(static_cast<size_t>(workers.count()), SmallBlock::Zero());
    workers.ForParts(a.rows(), kStretch, [&](int64_t begin, int64_t end, int t) {
      SmallBlockOf<Real> product;
      for (int64_t i = begin; i < end; i += kStretch) {
        BlockDot(At(a, i), At(b, i), std::min(kStretch, end - i), product.data());
        parts[static_cast<size_t>(t)] += product.template cast<double>();
      }
    });
    for (size_t t = 1; t < parts.size(); ++t) parts[0] += parts[t];
    return parts[0];
  }

  /// Computes x -= Q h.
  void Subtract(const Coefficients& h, Block& x) const {
    std::vector<SmallBlockOf<Real>> rounded;
    for (const SmallBlock& part : h) rounded.push_back(part.template cast<Real>());
    workers_.ForParts(rows_, kStretch, [&](int64_t begin, int64_t end, int) {
      for (int64_t i = begin; i < end; i += kStretch) {
        const int64_t count = std::min(kStretch, end - i);
        for (size_t b = 0; b < rounded.size(); ++b) {
          BlockSubtractTimes(At(*blocks_[b], i), rounded[b].data(), count, At(x, i));
        }
      }
    });
  }

  /// Returns Q s in blocks. s has size() rows, and a multiple of kBlockWidth columns.
  std::vector<Block> Combine(const Eigen::MatrixXd& s) const {
    const size_t count = static_cast<size_t>(s.cols()) / kBlockWidth;
    std::vector<Block> result(count, Block::Zero(rows_, kBlockWidth));
    std::vector<SmallBlockOf<Real>> minus;
    for (size_t c = 0; c < count; ++c) {
      for (size_t b = 0; b < blocks_.size(); ++b) {
        minus.push_back((-s.block<kBlockWidth, kBlockWidth>(Row(b), Row(c))).cast<Real>());
      }
    }
    workers_.ForParts(rows_, kStretch, [&](int64_t begin, int64_t end, int) {
      for (int64_t i = begin; i < end; i += kStretch) {
        const int64_t rows = std::min(kStretch, end - i);
        for (size_t c = 0; c < count; ++c) {
          for (size_t b = 0; b < blocks_.size(); ++b) {
            BlockSubtractTimes(At(*blocks_[b], i), minus[c * blocks_.size() + b].data(), rows,
                               At(result[c], i));
          }
        }
      }
    });
    return result;
  }

 private:
  static Eigen::Index Row(size_t block) { return static_cast<Eigen::Index>(block) * kBlockWidth; }

  static constexpr int64_t kStretch = 256;

  static const Real* At(const Block& block, int64_t row) {
    return block.data() + row * kBlockWidth;
  }
  static Real* At(Block& block, int64_t row) { return block.data() + row * kBlockWidth; }

  Coefficients ProjectRows(const Block& x, int64_t begin, int64_t end) const {
    Coefficients h(blocks_.size(), SmallBlock::Zero());
    SmallBlockOf<Real> product;
    for (int64_t i = begin; i < end; i += kStretch) {
      const int64_t count = std::min(kStretch, end - i);
      for (size_t b = 0; b < blocks_.size(); ++b) {
        BlockDot(At(*blocks_[b], i), At(x, i), count, product.data());
        h[b] += product.template cast<double>();
      }
    }
    return h;
  }

  Eigen::Index rows_;
  Workers& workers_;
  std::vector<std::unique_ptr<Block>> blocks_;
};

}  // namespace carillon::precompute
