// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/block_gram.h"

#include <algorithm>

#include "precompute/sparse/dense_blas.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Number of rows packed for a matrix product; they fit into the second-level cache.
constexpr int64_t kStretch = 256;

/// Number of columns of a lower triangle that one product computes.
constexpr Index kStrip = 64;

Index VectorCount(const VectorBlocks& x) { return static_cast<Index>(x.size()) * kBlockWidth; }

/// Packs rows first ... first + count - 1 of all vectors; each row becomes a column of `packed`.
void Pack(const VectorBlocks& x, int64_t first, int64_t count, MatrixXd& packed) {
  for (size_t b = 0; b < x.size(); ++b) {
    const double* from = x[b].data() + first * kBlockWidth;
    double* to = packed.data() + b * kBlockWidth;
    for (int64_t r = 0; r < count; ++r, from += kBlockWidth, to += packed.rows()) {
      std::copy_n(from, kBlockWidth, to);
    }
  }
}

void Unpack(const MatrixXd& packed, int64_t first, int64_t count, VectorBlocks& x) {
  for (size_t b = 0; b < x.size(); ++b) {
    const double* from = packed.data() + b * kBlockWidth;
    double* to = x[b].data() + first * kBlockWidth;
    for (int64_t r = 0; r < count; ++r, from += packed.rows(), to += kBlockWidth) {
      std::copy_n(from, kBlockWidth, to);
    }
  }
}

/// gram -= x^T y for packed vectors.
void SubtractGram(const MatrixXd& x, const MatrixXd& y, int64_t count, MatrixXd& gram) {
  const Index n = gram.rows();
  const auto ld = static_cast<int>(n);
  for (Index j = 0; j < n; j += kStrip) {
    const auto width = static_cast<int>(std::min(kStrip, n - j));
    blas::SubtractProduct(static_cast<int>(n - j), width, static_cast<int>(count), x.data() + j, ld,
                          y.data() + j, ld, &gram(j, j), ld);
  }
}

}  // namespace

MatrixXd Gram(const VectorBlocks& x, const VectorBlocks& y, Workers& workers) {
  const Index n = VectorCount(x);
  std::vector<MatrixXd> parts(static_cast<size_t>(workers.count()), MatrixXd::Zero(n, n));
  const int64_t rows = x.empty() ? 0 : x[0].rows();
  workers.ForParts(rows, kStretch, [&](int64_t begin, int64_t end, int t) {
    MatrixXd packed_x(n, kStretch);
    MatrixXd packed_y(&x == &y ? 0 : n, kStretch);
    for (int64_t i = begin; i < end; i += kStretch) {
      const int64_t count = std::min(kStretch, end - i);
      Pack(x, i, count, packed_x);
      if (&x != &y) Pack(y, i, count, packed_y);
      SubtractGram(packed_x, &x == &y ? packed_x : packed_y, count, parts[static_cast<size_t>(t)]);
    }
  });
  MatrixXd gram = -parts[0];
  for (size_t t = 1; t < parts.size(); ++t) gram -= parts[t];
  return gram;
}

void Rotate(const MatrixXd& V, Workers& workers, VectorBlocks& x) {
  const Index n = VectorCount(x);
  const auto size = static_cast<int>(n);
  const int64_t rows = x.empty() ? 0 : x[0].rows();
  workers.ForParts(rows, kStretch, [&](int64_t begin, int64_t end, int) {
    MatrixXd packed(n, kStretch);
    MatrixXd rotated(n, kStretch);
    for (int64_t i = begin; i < end; i += kStretch) {
      const int64_t count = std::min(kStretch, end - i);
      Pack(x, i, count, packed);
      blas::TransposedProduct(size, static_cast<int>(count), size, V.data(), size, packed.data(),
                              size, rotated.data(), size);
      Unpack(rotated, i, count, x);
    }
  });
}

}  // namespace carillon::precompute
