// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// Counts the eigenvalues of K x = Lambda M x below `shift`: by Sylvester's law of inertia the
/// negative pivots of an LDL^T factorization of K - shift M. Unreliable only where the shift agrees
/// with an eigenvalue to nearly all digits.
///
/// `order`: pivot order of the unknowns, see OrderUnknowns.
/// Errors: OUT_OF_MEMORY, VERIFICATION_FAILED (the factorization broke down).
absl::StatusOr<int> CountEigenvaluesBelow(const SystemMatrices& system, double shift,
                                          const std::vector<int>& order);

}  // namespace carillon::precompute
