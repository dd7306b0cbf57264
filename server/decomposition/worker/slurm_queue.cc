// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/slurm_queue.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/decomposition/worker/run_command.h"

namespace carillon {
namespace {

// Slurm's reason for a job that its node refused: a controller that forgot a job has given the
// number to this one, and the first still runs on the node. Jobs held by people have other reasons.
constexpr char kRefusedByNode[] = "launch failed requeued held";

SlurmState StateOf(absl::string_view word, absl::string_view reason) {
  if (word == "PENDING" && reason == kRefusedByNode) return SlurmState::kStuck;
  for (const char* alive : {"PENDING", "RUNNING", "CONFIGURING", "COMPLETING", "SUSPENDED",
                            "REQUEUED", "REQUEUE_HOLD", "REQUEUE_FED", "RESIZING", "SIGNALING",
                            "STAGE_OUT", "STOPPED", "SPECIAL_EXIT", "RESV_DEL_HOLD"}) {
    if (word == alive) return SlurmState::kWaitsOrRuns;
  }
  if (word == "COMPLETED") return SlurmState::kCompleted;
  // A job without a result was killed for its use of memory, which older Slurms report as FAILED.
  if (word == "OUT_OF_MEMORY" || word == "FAILED") return SlurmState::kOutOfMemory;
  if (word == "TIMEOUT" || word == "DEADLINE") return SlurmState::kTimeout;
  if (absl::StartsWith(word, "CANCELLED")) return SlurmState::kCancelled;
  return SlurmState::kLost;
}

}  // namespace

SlurmJobs ParseSqueue(const std::string& output) {
  SlurmJobs jobs;
  for (const absl::string_view line : absl::StrSplit(output, '\n')) {
    const std::vector<std::string> fields = absl::StrSplit(line, '|');
    if (fields.size() < 3) continue;
    const SlurmState state = StateOf(fields[2], fields.size() > 3 ? fields[3] : "");
    const auto [known, is_new] = jobs.emplace(std::pair(fields[0], fields[1]), state);
    if (!is_new) known->second = std::min(known->second, state);
  }
  return jobs;
}

std::optional<SlurmJobs> ReadSqueue() {
  const CommandResult result =
      RunCommand({"squeue", "--noheader", "--states=all", "--format=%j|%k|%T|%r"});
  if (!result.success) return std::nullopt;
  return ParseSqueue(result.output);
}

std::optional<SlurmState> ReadSacct(const std::string& name, const std::string& ticket) {
  const CommandResult result =
      RunCommand({"sacct", "--noheader", "--parsable2", "--allocations",
                  absl::StrCat("--name=", name), "--format=jobname,comment,state"});
  if (!result.success) return std::nullopt;
  const SlurmJobs jobs = ParseSqueue(result.output);
  const auto job = jobs.find({name, ticket});
  if (job == jobs.end()) return std::nullopt;
  return job->second;
}

bool Submit(const SlurmJob& job) {
  const std::vector<std::string> command = {
      "sbatch",
      "--parsable",
      absl::StrCat("--job-name=", job.name),
      absl::StrCat("--comment=", job.ticket),
      absl::StrCat("--cpus-per-task=", job.thread_count),
      absl::StrCat("--mem=", (job.memory_bytes >> 20U) + 1, "M"),
      absl::StrCat("--time=", job.time_limit_s / 60 + 1),
      "--requeue",
      "--output=/dev/null",
      "--error=/dev/null",
      "--chdir=/"};
  return RunCommand(command, job.script).success;
}

void CancelByName(const std::string& name) {
  RunCommand({"scancel", "--quiet", absl::StrCat("--name=", name)});
}

}  // namespace carillon
