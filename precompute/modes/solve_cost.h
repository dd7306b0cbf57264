// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "precompute/modes/ordered_system.h"

namespace carillon::precompute {

/// What a solution takes, known from the symbolic analysis alone.
struct SolveCost {
  size_t peak_bytes = 0;   ///< of everything that the solution allocates, the matrices included
  double cpu_seconds = 0;  ///< on a core of 2023 with AVX-512; a few times as many on an old one
};

/// `mode_count`: rigid-body modes included.
SolveCost PredictSolveCost(const OrderedSystem& ordered, int mode_count, int thread_count);

/// Errors: MEMORY_TOO_SMALL with the figures needed_bytes and available_bytes, where the machine
/// has less memory available than `cost` says.
absl::Status CheckMemory(const SolveCost& cost);

}  // namespace carillon::precompute
