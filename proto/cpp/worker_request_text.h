// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "carillon/worker/v1/worker.pb.h"

namespace carillon {

/// Returns a request to a decomposing process in protobuf's text form. People can read this form,
/// shell scripts can contain it, and a worker refuses a setting that it does not know. In the
/// binary form an older worker would ignore the setting, and compute another model under the same
/// name.
std::string WorkerRequestText(const worker::v1::WorkerRequest& request);

/// Reads the text that WorkerRequestText wrote. Errors: InvalidArgument (INVALID_SETTINGS; the
/// message names line and column).
absl::StatusOr<worker::v1::WorkerRequest> ParseWorkerRequest(absl::string_view text);

}  // namespace carillon
