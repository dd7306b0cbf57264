// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "precompute/sparse/ordered_system.h"

namespace carillon::precompute {

/// The predicted cost of a solution, computed from the symbolic analysis alone.
struct SolveCost {
  size_t peak_bytes = 0;    ///< peak of all memory of the solution, including the matrices
  size_t matrix_bytes = 0;  ///< memory of the matrices, which exist already
  /// Processor time on a core of 2023 with AVX-512; an old core needs a few times as much.
  double count_s = 0;   ///< counting the modes by inertia
  double factor_s = 0;  ///< the factorization for the solves
  double solve_s = 0;   ///< iteration and refinement
  double verify_s = 0;  ///< residuals and orthogonality
  double model_s = 0;   ///< couplings, estimated errors

  double cpu_seconds() const { return count_s + factor_s + solve_s + verify_s + model_s; }
};

/// Returns the predicted number of vectors in the basis when `mode_count` modes have converged.
/// Measurements gave 4.5 times the number of modes for 60 modes, and 2.8 times for 280.
double PredictBasisSize(int mode_count);

/// Predicts the cost of BlockLanczosEigensolver. `mode_count` includes rigid-body modes.
SolveCost PredictSolveCost(const OrderedSystem& ordered, int mode_count, int thread_count);

/// Checks that the machine has the memory available that `cost` needs in addition to the matrices.
/// Errors: MEMORY_TOO_SMALL with the figures needed_bytes and available_bytes.
absl::Status CheckMemory(const SolveCost& cost);

}  // namespace carillon::precompute
