// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "client_sdk/cli/program.h"

namespace carillon::cli {

/// Examines the daemon and this machine. For each property that must be right, prints a line that
/// says whether it is right, and what to do if it is not. Prints the same as JSON if that is asked
/// for. Errors: FailedPrecondition (FAULTS_FOUND).
absl::Status Diagnose(const Program& program);

}  // namespace carillon::cli
