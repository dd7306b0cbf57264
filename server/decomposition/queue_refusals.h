// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "absl/status/status.h"

namespace carillon {

/// Returns NotFound (JOB_NOT_FOUND).
absl::Status JobNotFound(const std::string& digest);

/// Returns ResourceExhausted (QUEUE_FULL) for a queue in which `count` jobs wait.
absl::Status QueueFull(size_t count, double retry_after_s);

/// Returns ResourceExhausted (CLIENT_LIMIT_REACHED) for a client of which `count` jobs wait in a
/// queue of the size `whole`.
absl::Status ClientQueueFull(size_t count, size_t whole);

}  // namespace carillon
