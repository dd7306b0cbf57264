// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "carillon/client.h"

namespace carillon::cli {

/// Prints a line for the health of the daemon and of each service, with what to do where it does
/// not serve. Prints the same as JSON if that is asked for: {"fault_count": 1, "findings":
/// [{"subject": ..., "verdict": "OK" or "FAULT", "text": ...}]}. Errors: FailedPrecondition
/// (NOT_SERVING), those of Client::IsServing.
absl::Status Diagnose(const client::Client& daemon, bool json);

}  // namespace carillon::cli
