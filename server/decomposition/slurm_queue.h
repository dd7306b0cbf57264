// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace carillon {

/// What Slurm knows of the jobs of one name and ticket.
enum class SlurmState {
  kWaitsOrRuns,
  kCompleted,
  kOutOfMemory,
  kTimeout,
  kCancelled,
  kLost,   ///< its node failed, or something else that another run may be spared
  kStuck,  ///< its node refused it, and it is held until somebody releases it
};

/// A job as it is submitted. The ticket tells this submission's jobs from older ones of the name.
struct SlurmJob {
  std::string name;
  std::string ticket;
  std::string script{};  ///< its text
  std::string partition;
  int thread_count = 1;
  uint64_t memory_bytes = 0;
  int64_t time_limit_s = 0;
};

/// By name and ticket; of several jobs of one, the state that leaves most hope.
using SlurmJobs = std::map<std::pair<std::string, std::string>, SlurmState>;

/// What `squeue` prints for its format "%j|%k|%T|%r", or sacct without the reason, for the tests.
SlurmJobs ParseSqueue(const std::string& output);

/// All jobs in the queue and those that ended lately; absent where the controller does not answer.
std::optional<SlurmJobs> ReadSqueue();

/// What accounting knows of a job that the queue has forgotten; absent where there is none.
std::optional<SlurmState> ReadSacct(const std::string& name, const std::string& ticket);

/// Whether the controller says that it has taken the job. It may have, even if not.
bool Submit(const SlurmJob& job);

/// Cancels every job of a name, if the controller answers.
void CancelByName(const std::string& name);

}  // namespace carillon
