// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/multifrontal_inertia.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "precompute/modes/dense_blas.h"
#include "precompute/modes/front_walk.h"
#include "precompute/modes/strips.h"
#include "proto/error_reason.h"

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
absl::Status FactorizePanel(Front<double>& front, double smallest, Workers& workers,
                            std::vector<double>& scaled, int& negative) {
  const int h = front.height();
  const int p = front.pivots;
  for (int k = 0; k < p; k += kLdlBlock) {
    const int width = std::min(kLdlBlock, p - k);
    const int rest = h - k - width;
    const size_t corner = static_cast<size_t>(k) * static_cast<size_t>(h + 1);
    double* block = &front.panel[corner];
    if (!FactorizeBlock(width, block, h, smallest, negative)) return VanishingPivot();
    double* L = block + width;
    double* LD = scaled.data() + corner + width;
    workers.ForParts(rest, 16, [&](int64_t begin, int64_t end, int) {
      blas::SolveRight(static_cast<int>(end - begin), width, block, h, L + begin, h, true);
      for (int c = 0; c < width; ++c) {
        const ptrdiff_t column = static_cast<ptrdiff_t>(c) * h;
        const double d = block[column + c];
        std::copy(L + column + begin, L + column + end, LD + column + begin);
        for (int64_t i = begin; i < end; ++i) L[column + i] /= d;
      }
    });
    ForStrips(workers, p - k - width, [&](int j, int columns) {
      blas::SubtractProduct(rest - j, columns, width, L + j, h, LD + j, h,
                            L + static_cast<ptrdiff_t>(width + j) * h + j, h);
    });
  }
  return absl::OkStatus();
}

absl::Status EliminateLdl(Front<double>& front, double smallest, Workers& workers, int& negative) {
  std::vector<double> scaled(front.panel.size());
  if (absl::Status status = FactorizePanel(front, smallest, workers, scaled, negative);
      !status.ok()) {
    return status;
  }
  const int h = front.height();
  const int p = front.pivots;
  const int u = front.updates;
  ForStrips(workers, u, [&](int j, int columns) {
    blas::SubtractProduct(u - j, columns, p, front.panel.data() + p + j, h, scaled.data() + p + j,
                          h, front.update + static_cast<ptrdiff_t>(j) * (u + 1), u);
  });
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<int> CountEigenvaluesBelow(const FrontalStructure& fronts, const NodeMatrix& A,
                                          double shift, Workers& workers,
                                          const PartDone& progress) {
  double largest = 0;
  for (size_t e = 0; e < A.row.size(); ++e)
    largest = std::max(largest, std::abs(A.stiffness[9 * e]));
  // Below this the sign of a pivot is rounding.
  const double smallest = 1e-14 * largest;
  std::atomic<int> negative = 0;
  const auto eliminate = [&](int, Front<double>& front, Workers& sharing) {
    int count = 0;
    absl::Status status = EliminateLdl(front, smallest, sharing, count);
    negative += count;
    return status;
  };
  FrontWalk<double, decltype(eliminate)> walk(fronts, A, shift, eliminate, workers);
  if (absl::Status status = walk.Run(progress); !status.ok()) return status;
  return negative;
}

}  // namespace carillon::precompute
