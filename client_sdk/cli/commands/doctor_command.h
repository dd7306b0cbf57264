// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "client_sdk/cli/commands/program.h"

namespace carillon::cli {

/// Prints a line for the settings of the daemon, as `carillond --check-config` judges them, and one
/// for the health of each service, with what to do where something is wrong. Prints the same as
/// JSON if that is asked for: {"fault_count": 1, "findings": [{"subject": ..., "verdict": "OK",
/// "FAULT" or "UNKNOWN", "text": ...}]}. Errors: FailedPrecondition (NOT_SERVING).
absl::Status Diagnose(const Program& program);

}  // namespace carillon::cli
