// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace carillon {

/// The state, according to Slurm, of the jobs with one name and ticket.
enum class SlurmState {
  kWaitsOrRuns,
  kCompleted,
  kOutOfMemory,
  kTimeout,
  kCancelled,
  kLost,   ///< ended by a failed node or another cause that may not recur
  kStuck,  ///< refused by its node, and held until it is released
};

/// A job to submit. The ticket distinguishes this submission from older ones of the same name.
struct SlurmJob {
  std::string name;
  std::string ticket;
  std::string script{};  ///< the text of the script
  int thread_count = 1;
  uint64_t memory_bytes = 0;
  int64_t time_limit_s = 0;
};

/// States by name and ticket. If several jobs have the same name and ticket, the state nearest to
/// success counts.
using SlurmJobs = std::map<std::pair<std::string, std::string>, SlurmState>;

/// Parses the output of `squeue` in the format "%j|%k|%T|%r", or of sacct, which lacks the reason.
SlurmJobs ParseSqueue(const std::string& output);

/// Returns all jobs in the queue and those that ended lately, or nothing if the controller does not
/// answer.
std::optional<SlurmJobs> ReadSqueue();

/// Returns the state that Slurm's accounting has for a job that has left the queue, or nothing if
/// it has no record of the job.
std::optional<SlurmState> ReadSacct(const std::string& name, const std::string& ticket);

/// Submits the job. Even if this returns false, the controller may have taken the job, because its
/// answer may have been lost.
bool Submit(const SlurmJob& job);

/// Cancels every job with this name if the controller answers.
void CancelByName(const std::string& name);

}  // namespace carillon
