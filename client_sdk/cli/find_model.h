// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/client.h"

namespace carillon::cli {

/// The name "modalModels/{digest}" of the one model that `text` means: that name itself, a label,
/// or the first digits of a digest. Errors: NotFound (MODAL_MODEL_NOT_FOUND), InvalidArgument
/// (MODAL_MODEL_AMBIGUOUS), and those of Client::ListModalModels.
absl::StatusOr<std::string> FindModel(const client::Client& daemon, const std::string& text);

/// Likewise the name "jobs/{digest}" of a job. Errors: NotFound (JOB_NOT_FOUND), InvalidArgument
/// (JOB_AMBIGUOUS), and those of Client::ListJobs.
absl::StatusOr<std::string> FindJob(const client::Client& daemon, const std::string& text);

}  // namespace carillon::cli
