// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "precompute/sparse/ordered_system.h"

namespace carillon::precompute {

/// What a solution takes, known from the symbolic analysis alone.
struct SolveCost {
  size_t peak_bytes = 0;    ///< of everything that the solution allocates, the matrices included
  size_t matrix_bytes = 0;  ///< of those, which are there already
  /// Processor time on a core of 2023 with AVX-512; a few times as many on an old one.
  double count_s = 0;   ///< of the modes, by inertia
  double factor_s = 0;  ///< the factorization to solve with
  double solve_s = 0;   ///< iteration and refinement
  double verify_s = 0;  ///< residuals and orthogonality
  double model_s = 0;   ///< couplings, estimated errors

  double cpu_seconds() const { return count_s + factor_s + solve_s + verify_s + model_s; }
};

/// Vectors in the basis of the iteration when so many modes have converged, as measured: 4.5 times
/// 60, 2.8 times 280.
double PredictBasisSize(int mode_count);

/// `mode_count`: rigid-body modes included.
SolveCost PredictSolveCost(const OrderedSystem& ordered, int mode_count, int thread_count);

/// Errors: MEMORY_TOO_SMALL with the figures needed_bytes and available_bytes, where the machine
/// has less memory available than `cost` says beyond the matrices.
absl::Status CheckMemory(const SolveCost& cost);

}  // namespace carillon::precompute
