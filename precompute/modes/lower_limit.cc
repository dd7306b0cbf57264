// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/lower_limit.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "proto/cpp/status_macros.h"

namespace carillon::precompute {

absl::StatusOr<Counted> LowerLimit(
    Counted above, int most, const std::function<absl::StatusOr<int>(double limit)>& count_below) {
  constexpr int kMostCounts = 8;
  constexpr double kEnough = 0.5;
  constexpr double kAimedAt = 0.75;
  // In a solid, the n-th eigenvalue grows with this power of n. In a wall it grows faster.
  constexpr double kPowerInSolid = 2.0 / 3;
  double power = kPowerInSolid;
  std::optional<Counted> below;
  for (int counts = 0; counts < kMostCounts; ++counts, power += kPowerInSolid) {
    if (below) {
      power = std::log(above.limit / below->limit) /
              std::log(static_cast<double>(above.count) / std::max(below->count, 1));
    }
    const double limit = above.limit * std::pow(kAimedAt * most / above.count, power);
    ASSIGN_OR_RETURN(const int count, count_below(limit));
    (count > most ? above : below.emplace()) = {limit, count, above.asked_count};
    if (below && below->count >= kEnough * most) break;
  }
  return below.value_or(above);
}

double WeylModeCount(const SystemMatrices& system, double limit) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(system.unknown_count());
  const double volume = ones.dot(system.M.selfadjointView<Eigen::Lower>() * ones) / 3;
  return 0.153 * volume * std::pow(limit, 1.5);
}

int LargestThat(int least, int most, const std::function<bool(int)>& holds) {
  int fits = least;
  int too_many = most + 1;
  while (too_many - fits > 1) {
    const int middle = fits + (too_many - fits) / 2;
    (holds(middle) ? fits : too_many) = middle;
  }
  return fits;
}

}  // namespace carillon::precompute
