// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "carillon/client.h"

namespace carillon::cli {

/// Returns the first digits of the digest in the name of a job, by which every command finds the
/// job. `job` must outlive the result.
absl::string_view ShortName(const v1::Job& job);

/// Returns the progress of a job as text, such as "52 %  solving, 38120 nodes, 12 modes" or
/// "0 %  waiting: 2 jobs are before it".
std::string ProgressText(const v1::Job& job);

/// Returns a line about a job with the first digits of its digest, its progress, the time since it
/// was started or requested, and its label. The label is escaped for a terminal (EscapedText).
std::string JobLine(const v1::Job& job, absl::Time now);

/// Returns a duration as text, such as "12 s", "3 min", "5.2 h" or "9 days".
std::string RoughTime(double seconds);

/// Waits until a job ends (Client::WatchJob), and shows its progress on stderr: as a bar on a
/// terminal, otherwise as a line for each phase. Calls `on_state`, if given, with each state.
absl::StatusOr<v1::Job> WatchWithProgress(
    const client::Client& daemon, const std::string& name,
    const std::function<void(const v1::Job&)>& on_state = nullptr);

}  // namespace carillon::cli
