// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon {

/// A request to a decomposing process in protobuf's text form, in which people can read it, shell
/// scripts can carry it, and a worker refuses a setting that it does not know. (From the binary
/// form an older worker would drop the setting, and compute another model under this one's name.)
std::string WorkerRequestText(const v1::WorkerRequest& request);

/// The inverse of WorkerRequestText. Errors: InvalidArgument (INVALID_SETTINGS; the message names
/// line and column).
absl::StatusOr<v1::WorkerRequest> ParseWorkerRequest(absl::string_view text);

}  // namespace carillon
