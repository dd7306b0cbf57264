// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "carillon/client.h"
#include "client_sdk/cli/commands/commands.h"

namespace carillon::cli {

/// Renders the contact traces of a folder into another folder (ClipFolder). Clips that are there
/// already stay. A trace that cannot be rendered does not stop the others. Errors: NotFound
/// (FILE_NOT_FOUND), Internal (OUTPUT_NOT_WRITABLE), FailedPrecondition (SOME_FAILED), Cancelled
/// (RENDERING_STOPPED: `stop` has arrived).
absl::Status RenderClips(const client::Client& daemon, const RenderOptions& options,
                         const StopSignal& stop, bool json);

}  // namespace carillon::cli
