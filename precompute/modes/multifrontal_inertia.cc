// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/multifrontal_inertia.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "precompute/modes/dense_blas.h"
#include "precompute/modes/front_walk.h"

namespace carillon::precompute {
namespace {

constexpr int kLdlBlock = 48;

/// A = L D L^T of a small block, in place (D on the diagonal). Returns false at a vanishing pivot.
bool FactorizeBlock(int n, double* A, int ld, double smallest, int& negative) {
  for (int c = 0; c < n; ++c) {
    double* column = A + static_cast<ptrdiff_t>(c) * ld;
    const double d = column[c];
    if (!(std::abs(d) > smallest)) return false;
    negative += d < 0 ? 1 : 0;
    for (int j = c + 1; j < n; ++j) {
      const double l = column[j] / d;
      double* target = A + static_cast<ptrdiff_t>(j) * ld;
      for (int i = j; i < n; ++i) target[i] -= l * column[i];
    }
    for (int i = c + 1; i < n; ++i) column[i] /= d;
  }
  return true;
}

absl::Status VanishingPivot() {
  return Refusal(
      absl::StatusCode::kInternal, "VERIFICATION_FAILED",
      "a pivot vanished while eigenvalues were counted: the shift lies on an eigenvalue");
}

/// Turns the panel into L and `scaled`, of its shape, into L D below each diagonal block.
absl::Status FactorizePanel(Front<double>& front, double smallest, std::vector<double>& scaled,
                            int& negative) {
  const int h = front.height();
  const int p = front.pivots;
  for (int k = 0; k < p; k += kLdlBlock) {
    const int width = std::min(kLdlBlock, p - k);
    const int rest = h - k - width;
    const size_t corner = static_cast<size_t>(k) * static_cast<size_t>(h + 1);
    double* block = &front.panel[corner];
    if (!FactorizeBlock(width, block, h, smallest, negative)) return VanishingPivot();
    if (rest == 0) continue;
    double* L = block + width;
    double* LD = &scaled[corner] + width;
    blas::SolveRight(rest, width, block, h, L, h, true);
    for (int c = 0; c < width; ++c) {
      const ptrdiff_t column = static_cast<ptrdiff_t>(c) * h;
      const double d = block[column + c];
      std::copy(L + column, L + column + rest, LD + column);
      for (int i = 0; i < rest; ++i) L[column + i] /= d;
    }
    const int later = p - k - width;
    if (later == 0) continue;
    blas::SubtractProduct(rest, later, width, L, h, LD, h, L + static_cast<ptrdiff_t>(width) * h,
                          h);
  }
  return absl::OkStatus();
}

absl::Status EliminateLdl(Front<double>& front, double smallest, int& negative) {
  std::vector<double> scaled(front.panel.size());
  if (absl::Status status = FactorizePanel(front, smallest, scaled, negative); !status.ok()) {
    return status;
  }
  const int h = front.height();
  const int p = front.pivots;
  constexpr int kColumns = 192;  // Only the lower triangle of the update matrix is wanted.
  for (int j = 0; j < front.updates; j += kColumns) {
    blas::SubtractProduct(front.updates - j, std::min(kColumns, front.updates - j), p,
                          front.panel.data() + p + j, h, scaled.data() + p + j, h,
                          front.update.get() + static_cast<ptrdiff_t>(j) * (front.updates + 1),
                          front.updates);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<int> CountEigenvaluesBelow(const FrontalStructure& fronts, const NodeMatrix& A,
                                          double shift, const PartDone& progress) {
  double largest = 0;
  for (size_t e = 0; e < A.row.size(); ++e)
    largest = std::max(largest, std::abs(A.stiffness[9 * e]));
  // Below this the sign of a pivot is rounding.
  const double smallest = 1e-14 * largest;
  int negative = 0;
  const auto eliminate = [&](int, Front<double>& front) {
    return EliminateLdl(front, smallest, negative);
  };
  FrontWalk<double, decltype(eliminate)> walk(fronts, A, shift);
  if (absl::Status status = walk.Run(eliminate, progress); !status.ok()) return status;
  return negative;
}

}  // namespace carillon::precompute
