// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/client.h"

namespace carillon::cli {

/// "52 %  solving, 38120 nodes, 12 modes": how far a job is, in words.
std::string ProgressText(const v1::Job& job);

/// Follows a job to its end (Client::WatchJob) and shows its progress on stderr: a bar on a
/// terminal, elsewhere a line for each phase.
absl::StatusOr<v1::Job> WatchWithProgress(const client::Client& daemon, const std::string& name);

}  // namespace carillon::cli
