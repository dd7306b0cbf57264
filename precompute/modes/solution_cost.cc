// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/solution_cost.h"

#include <cmath>

#include "precompute/sparse/openblas.h"

namespace carillon::precompute {
namespace {

/// Time of the dense solver divided by the cube of the number of unknowns; see PrefersDense.
constexpr double kDenseSeconds = 1.4e-10;

}  // namespace

bool PrefersDense(Eigen::Index unknown_count, int mode_count) {
  // Solid boxes of 720, 1944 and 3960 unknowns, CPU seconds: dense 0.16, 1.2, 8.6; block Lanczos
  // 0.09, 0.75, 4.3 for a tenth of all modes and 0.29, 3.9, 22 for a fifth. Four full matrices of
  // 10,000 unknowns fill 3.2 GB.
  constexpr Eigen::Index kSmall = 600;
  constexpr Eigen::Index kTooLarge = 10'000;
  return unknown_count <= kSmall ||
         (unknown_count <= kTooLarge && 8 * Eigen::Index{mode_count} > unknown_count);
}

SolveCost CostOfSolution(const OrderedSystem& ordered, int mode_count) {
  SolveCost cost = PredictSolveCost(ordered, mode_count, ThreadCount());
  const auto unknown_count = static_cast<Eigen::Index>(3 * ordered.fronts.order.size());
  if (!PrefersDense(unknown_count, mode_count)) return cost;
  cost.factor_s = 0;
  cost.solve_s = kDenseSeconds * std::pow(static_cast<double>(unknown_count), 3);
  return cost;
}

bool Afford(const Means& means, const SolveCost& cost) {
  return cost.peak_bytes <= means.bytes && cost.cpu_seconds() <= means.cpu_s;
}

}  // namespace carillon::precompute
