// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// An eigenvalue, and the numbers of eigenvalues below it and, as counted or expected, below the
/// one that was asked for.
struct Counted {
  double limit;
  int count;
  int asked_count;
};

/// Finds a limit below `above.limit` with at most `most` eigenvalues below it, and half as many at
/// least where a few counts suffice to find it. `count_below` counts the eigenvalues below a limit;
/// its errors are returned. `above.count` must be above `most`, which must be above zero.
absl::StatusOr<Counted> LowerLimit(
    Counted above, int most, const std::function<absl::StatusOr<int>(double limit)>& count_below);

/// Weyl's law for elastic waves in a volume, at a Poisson's ratio of 0.3 and unit Young's modulus
/// and density: a probable lower bound of the number of modes.
double WeylModeCount(const SystemMatrices& system, double limit);

/// The largest number from `least` to `most` for which `holds` is true, which must be true for all
/// numbers up to it; `least` if it is true for none.
int LargestThat(int least, int most, const std::function<bool(int)>& holds);

}  // namespace carillon::precompute
