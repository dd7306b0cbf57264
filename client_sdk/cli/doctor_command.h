// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "client_sdk/cli/program.h"

namespace carillon::cli {

/// Looks at the daemon and at this machine, and prints a line for each thing that must be right:
/// whether it is, and what to do if not; or all of that as JSON. Errors: FailedPrecondition
/// (FAULTS_FOUND).
absl::Status Diagnose(const Program& program);

}  // namespace carillon::cli
