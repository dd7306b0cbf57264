// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "carillon/client.h"

namespace carillon::cli {

/// Prints a line for the health of the daemon and of each service, and one for each cause of
/// silence or loss, with what docs/troubleshoot.md says to do. Prints the same as JSON if that is
/// asked for: {"fault_count": 1, "findings": [{"subject": ..., "verdict": "OK", "NOTE" or "FAULT",
/// "text": ..., "id": "FRAMES_LOST"}]}. Errors: FailedPrecondition (NOT_SERVING), those of
/// Client::IsServing and Client::GetMixer.
absl::Status Diagnose(const client::Client& daemon, bool json);

}  // namespace carillon::cli
