// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/front_elimination.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "precompute/sparse/dense_blas.h"
#include "precompute/sparse/strips.h"

namespace carillon::precompute {
namespace {

/// Number of columns eliminated at once, and the smaller number for a block with a negative pivot.
constexpr int kPanel = 96;
constexpr int kSignedPanel = 24;
/// Rows of the panel that one thread takes.
constexpr int kRowsTogether = 16;

/// Indices of the panel's columns with negative pivots.
using Columns = std::vector<int>;

template <typename Real>
class Eliminator {
 public:
  Eliminator(Front<Real>& front, Real smallest, Workers& workers)
      : front_(front), smallest_(smallest), workers_(workers) {}

  Elimination Run(int* negative) {
    for (int k = 0, width = 0; k < front_.pivots; k += width) {
      width = std::min(kPanel, front_.pivots - k);
      Columns signs;
      Elimination result = FactorizeBlock(k, width, negative != nullptr);
      if (result == Elimination::kNotPositive && negative != nullptr) {
        width = std::min(kSignedPanel, width);
        result = FactorizeSigned(k, width, signs);
      }
      if (result != Elimination::kDone) return result;
      SolveBelow(k, width, signs);
      SubtractFromPivots(k, width, signs);
      for (const int c : signs) negative_.push_back(k + c);
    }
    SubtractFromUpdate();
    if (negative != nullptr) *negative += static_cast<int>(negative_.size());
    return Elimination::kDone;
  }

 private:
  int height() const { return front_.height(); }
  Real* At(int row, int column) {
    return front_.panel.data() + static_cast<ptrdiff_t>(column) * height() + row;
  }

  /// `keep`: whether a block that is not positive definite stays unchanged.
  Elimination FactorizeBlock(int k, int width, bool keep) {
    std::vector<Real> copy;
    for (int c = k; keep && c < k + width; ++c) {
      copy.insert(copy.end(), At(c, c), At(k + width, c));
    }
    if (blas::Cholesky(width, At(k, k), height())) return CheckPivots(k, width);
    auto from = copy.cbegin();
    for (int c = k; keep && c < k + width; from += k + width - c, ++c) {
      std::copy_n(from, k + width - c, At(c, c));
    }
    return Elimination::kNotPositive;
  }

  /// A = L S L^T of a diagonal block; `negative`: its columns of negative pivots.
  Elimination FactorizeSigned(int k, int width, Columns& negative) {
    for (int c = 0; c < width; ++c) {
      Real* column = At(k, k + c);
      const Real d = column[c];
      if (!(std::abs(d) > smallest_)) return Elimination::kVanishing;
      if (d < 0) negative.push_back(c);
      for (int j = c + 1; j < width; ++j) {
        const Real l = column[j] / d;
        Real* target = At(k, k + j);
        for (int i = j; i < width; ++i) target[i] -= l * column[i];
      }
      const Real root = std::sqrt(std::abs(d));
      for (int i = c; i < width; ++i) column[i] *= root / d;
      column[c] = root;
    }
    return Elimination::kDone;
  }

  Elimination CheckPivots(int k, int width) {
    for (int c = k; c < k + width; ++c) {
      const Real root = *At(c, c);
      if (!(root * root > smallest_)) return Elimination::kVanishing;
    }
    return Elimination::kDone;
  }

  /// The rows below a diagonal block: B L^-T S.
  void SolveBelow(int k, int width, const Columns& negative) {
    const int first = k + width;
    workers_.ForParts(height() - first, kRowsTogether, [&](int64_t begin, int64_t end, int) {
      const auto rows = static_cast<int>(end - begin);
      Real* below = At(first + static_cast<int>(begin), k);
      blas::SolveRight(rows, width, At(k, k), height(), below, height());
      for (const int c : negative) {
        Real* column = below + static_cast<ptrdiff_t>(c) * height();
        std::transform(column, column + rows, column, std::negate<>());
      }
    });
  }

  /// The later pivot columns, less L S L^T of the block of columns from k on.
  void SubtractFromPivots(int k, int width, const Columns& negative) {
    const int first = k + width;
    ForStrips(workers_, front_.pivots - first, [&](int j, int columns) {
      const int at = first + j;
      blas::SubtractProduct(height() - at, columns, width, At(at, k), height(), At(at, k), height(),
                            At(at, at), height());
      for (const int c : negative) AddTwice(at, columns, k + c, At(at, at), height());
    });
  }

  void SubtractFromUpdate() {
    const int first = front_.pivots;
    const int u = front_.updates;
    const int pivots = front_.pivots;
    if (workers_.count() == 1 && u > 0) {
      blas::SubtractSquare(u, pivots, At(first, 0), height(), front_.update, u);
      for (const int c : negative_) AddTwice(first, u, c, front_.update, u);
      return;
    }
    ForStrips(workers_, u, [&](int j, int columns) {
      Real* target = front_.update + static_cast<ptrdiff_t>(j) * (u + 1);
      blas::SubtractProduct(u - j, columns, pivots, At(first + j, 0), height(), At(first + j, 0),
                            height(), target, u);
      for (const int c : negative_) AddTwice(first + j, columns, c, target, u);
    });
  }

  /// C += 2 l l^T in `columns` of its columns, l: column c from row `row` on.
  void AddTwice(int row, int columns, int c, Real* C, int ld) {
    const Real* l = At(row, c);
    const int rows = height() - row;
    for (int j = 0; j < columns; ++j) {
      const Real twice = 2 * l[j];
      Real* target = C + static_cast<ptrdiff_t>(j) * ld;
      for (int i = j; i < rows; ++i) target[i] += twice * l[i];
    }
  }

  Front<Real>& front_;
  const Real smallest_;
  Workers& workers_;
  Columns negative_;
};

}  // namespace

template <typename Real>
Elimination Eliminate(Front<Real>& front, Real smallest, Workers& workers, int* negative) {
  return Eliminator<Real>(front, smallest, workers).Run(negative);
}

template Elimination Eliminate(Front<float>&, float, Workers&, int*);
template Elimination Eliminate(Front<double>&, double, Workers&, int*);

}  // namespace carillon::precompute
