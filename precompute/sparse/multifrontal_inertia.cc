// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/multifrontal_inertia.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "precompute/sparse/front_elimination.h"
#include "precompute/sparse/front_walk.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

absl::Status VanishingPivot() {
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 "a pivot vanished while eigenvalues were counted: the shift lies on an "
                 "eigenvalue; try a tenth "
                 "more nodes (--nodes)");
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
    const Elimination result = Eliminate(front, smallest, sharing, &count);
    negative += count;
    return result == Elimination::kDone ? absl::OkStatus() : VanishingPivot();
  };
  FrontWalk<double, decltype(eliminate)> walk(fronts, A, shift, eliminate, workers);
  RETURN_IF_ERROR(walk.Run(progress));
  return negative;
}

}  // namespace carillon::precompute
