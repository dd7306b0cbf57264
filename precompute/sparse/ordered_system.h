// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/fem/assembly.h"
#include "precompute/sparse/frontal_structure.h"
#include "precompute/sparse/node_matrix.h"

namespace carillon::precompute {

/// K and M in elimination order, with the supernodes of their factorizations. One ordered system
/// serves every factorization of K - shift M.
struct OrderedSystem {
  FrontalStructure fronts;
  NodeMatrix matrix;

  /// Errors: OUT_OF_MEMORY.
  static absl::StatusOr<OrderedSystem> Make(const SystemMatrices& system);
};

}  // namespace carillon::precompute
