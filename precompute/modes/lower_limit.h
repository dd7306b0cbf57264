// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// A limit with the number of eigenvalues below it, and the counted or expected number of
/// eigenvalues below the limit that was requested.
struct Counted {
  double limit;
  int count;
  int asked_count;
};

/// Finds a limit below `above.limit` with at most `most` eigenvalues below it, and preferably with
/// at least half of `most`. The search ends after eight counts. If each of them exceeds `most`, the
/// last one is returned. `count_below` counts the eigenvalues below a limit; its errors are
/// returned. `above.count` must be above `most`, which must be above zero.
absl::StatusOr<Counted> LowerLimit(
    Counted above, int most, const std::function<absl::StatusOr<int>(double limit)>& count_below);

/// Returns the number of modes by Weyl's law for elastic waves in a volume, for a Poisson's ratio
/// of 0.3 and unit Young's modulus and density. It is a probable lower bound.
double WeylModeCount(const SystemMatrices& system, double limit);

/// Returns the largest number from `least` to `most` for which `holds` is true, or `least` if there
/// is none. If `holds` is true for a number, it must be true for all smaller ones.
int LargestThat(int least, int most, const std::function<bool(int)>& holds);

}  // namespace carillon::precompute
