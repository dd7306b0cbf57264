// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "absl/status/statusor.h"

namespace carillon::precompute {

/// Runs `work` in a forked child, silent on standard output and error, and returns its bytes. A
/// crash in `work` ends the child only. The child is killed when the calling thread ends, or when
/// the child has used `most_cpu` of processor time.
///
/// Errors: Aborted, stating how the child died; Internal if no child process could be started.
absl::StatusOr<std::string> RunInChild(const std::function<std::string()>& work,
                                       std::chrono::seconds most_cpu);

}  // namespace carillon::precompute
