// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// Writes `scale` times a symmetric matrix, given by its lower triangle, as a Matrix Market file
/// ("coordinate real symmetric", indices from 1, all digits).
/// Errors: Internal OUTPUT_NOT_WRITABLE.
absl::Status WriteMatrixMarket(const std::string& path, const SystemMatrices::Sparse& lower,
                               double scale);

}  // namespace carillon::precompute
