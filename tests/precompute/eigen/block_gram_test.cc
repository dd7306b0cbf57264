// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/block_gram.h"

#include <gtest/gtest.h>

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// More rows than are packed at once, and not a multiple of them.
constexpr Index kRows = 700;
constexpr size_t kBlocks = 6;

VectorBlocks RandomBlocks(unsigned seed) {
  std::srand(seed);
  VectorBlocks x(kBlocks);
  for (VectorBlock& block : x) block.setRandom(kRows, kBlockWidth);
  return x;
}

MatrixXd SideBySide(const VectorBlocks& x) {
  MatrixXd all(kRows, static_cast<Index>(x.size()) * kBlockWidth);
  for (size_t b = 0; b < x.size(); ++b) {
    all.middleCols<kBlockWidth>(static_cast<Index>(b) * kBlockWidth) = x[b];
  }
  return all;
}

TEST(BlockGram, HoldsTheProductsOfAllVectorsBelowTheDiagonal) {
  const VectorBlocks x = RandomBlocks(1);
  const VectorBlocks y = RandomBlocks(2);
  for (const int threads : {1, 2}) {
    Workers workers(threads);
    for (const VectorBlocks* other : {&x, &y}) {
      const MatrixXd expected = SideBySide(x).transpose() * SideBySide(*other);
      const MatrixXd off = Gram(x, *other, workers) - expected;
      // Sums of 700 products of numbers up to one.
      EXPECT_LT(off.triangularView<Eigen::Lower>().toDenseMatrix().cwiseAbs().maxCoeff(), 1e-11);
    }
  }
}

TEST(BlockGram, RotatesInPlace) {
  VectorBlocks x = RandomBlocks(3);
  const MatrixXd V = MatrixXd::Random(kBlocks * kBlockWidth, kBlocks * kBlockWidth);
  const MatrixXd expected = SideBySide(x) * V;
  Workers workers(2);
  Rotate(V, workers, x);
  EXPECT_LT((SideBySide(x) - expected).cwiseAbs().maxCoeff(), 1e-11);
}

}  // namespace
}  // namespace carillon::precompute
