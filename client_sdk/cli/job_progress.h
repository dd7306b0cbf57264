// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/client.h"

namespace carillon::cli {

/// Returns the progress of a job as text, such as "52 %  solving, 38120 nodes, 12 modes".
std::string ProgressText(const v1::Job& job);

/// Waits until a job ends (Client::WatchJob), and shows its progress on stderr: as a bar on a
/// terminal, otherwise as a line for each phase.
absl::StatusOr<v1::Job> WatchWithProgress(const client::Client& daemon, const std::string& name);

}  // namespace carillon::cli
