// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/slurm_task.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/decomposition/job/job_rules.h"
#include "server/decomposition/worker/worker_command.h"
#include "server/decomposition/worker/worker_events.h"

namespace carillon {
namespace {

// A run that vanishes without a word three times is taken to crash.
constexpr int kMostRuns = 3;
constexpr int kSignalled = 128;  // what a shell adds to the number of a signal
constexpr int kKilled = kSignalled + 9;

std::string ReadFile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool WriteFile(const std::filesystem::path& file, const std::string& content) {
  std::ofstream out(file, std::ios::binary);
  out << content;
  out.close();
  return !out.fail();
}

absl::Status Unusable(const std::filesystem::path& folder, absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("the shared folder ", folder.string(), " cannot be used (", why,
                              "): see that this user may write there"));
}

std::string Quoted(const std::string& word) {
  return absl::StrCat("'", absl::StrReplaceAll(word, {{"'", R"('\'')"}}), "'");
}

std::string Joined(const std::vector<std::string>& command) {
  std::string words;
  for (const std::string& word : command) absl::StrAppend(&words, " ", Quoted(word));
  return words;
}

// A link can be made once: of several runs of one job, one ends it.
std::string Script(const std::filesystem::path& folder, const std::vector<std::string>& command) {
  // The name of the result is known to the run alone.
  const std::string words =
      absl::StrReplaceAll(Joined(command), {{Quoted("--out=@model@"), "--out=\"model.$run\""}});
  return absl::StrCat("#!/bin/sh\ncd ", Quoted(folder.string()),
                      R"( || exit 1
[ -e end ] && exit 0
run=$SLURM_JOB_ID.${SLURM_RESTART_COUNT:-0}.$(date +%s%N)
: >"begun.$run"
)",
                      words, R"( 3>"events.$run" 2>"log.$run" >/dev/null
status=$?
echo "$run $status" >"ending.$run"
sync "ending.$run" "model.$run" 2>/dev/null
ln "ending.$run" end 2>/dev/null
exit 0
)");
}

std::string ReadTicket(const std::filesystem::path& folder) {
  return std::string(absl::StripAsciiWhitespace(ReadFile(folder / "ticket")));
}

std::string NewTicket() {
  std::random_device random;
  return absl::StrCat(absl::Hex(random()), "-", absl::Hex(random()));
}

// The events of a run; what follows after the last whole one is ignored.
std::vector<worker::v1::WorkerEvent> ReadEvents(const std::filesystem::path& file) {
  std::vector<worker::v1::WorkerEvent> events;
  WorkerEventReader reader;
  reader
      .Feed(ReadFile(file), [&](const worker::v1::WorkerEvent& event) { events.push_back(event); })
      .IgnoreError();
  return events;
}

Outcome Failure(Verdict verdict, v1::ErrorInfo error) { return {verdict, std::move(error), {}}; }

Outcome OutOfItsMemory(uint64_t limit_bytes) {
  return Failure(
      Verdict::kOutOfMemory,
      InternalError("OUT_OF_MEMORY",
                    absl::StrCat("the decomposition took more than the ", limit_bytes >> 20U,
                                 " MiB reserved for it: ask for fewer nodes or a lower maximal "
                                 "frequency, or give it more memory")));
}

Outcome Crashed(absl::string_view how) {
  return Failure(
      Verdict::kCrashed,
      InternalError(
          "WORKER_CRASHED",
          absl::StrCat("the decomposing process ", how,
                       ": check the mesh for faults such as crossing or doubled triangles")));
}

}  // namespace

absl::StatusOr<SlurmTask> SlurmTask::Prepare(DecompositionTask task,
                                             const SlurmExecutorOptions& options) {
  SlurmTask result(std::move(task), options);
  const DecompositionTask& own = result.task_;
  const std::string request = WorkerRequestFile(own);
  if (ReadFile(result.folder_ / "request") != request || ReadTicket(result.folder_).empty()) {
    RETURN_IF_ERROR(result.MakeFolder(request));
  }
  const uint64_t reserved =
      std::min({std::max<uint64_t>(2 * own.estimate_bytes, 256 << 20), options.memory_limit_bytes,
                own.request.memory_limit_bytes() > 0 ? own.request.memory_limit_bytes()
                                                     : options.memory_limit_bytes});
  const auto limit_s = static_cast<int64_t>(options.time_limit.count());
  const double wanted_s = own.request.time_limit_s();
  result.job_ = {
      .name = own.digest,
      .ticket = ReadTicket(result.folder_),
      .thread_count = options.threads_per_job,
      .memory_bytes = reserved,
      .time_limit_s = wanted_s > 0 ? std::min<int64_t>(std::llround(wanted_s), limit_s) : limit_s};
  return result;
}

// The ticket comes last: without it the folder is not taken up.
absl::Status SlurmTask::MakeFolder(const std::string& request) {
  std::error_code error;
  std::filesystem::remove_all(folder_, error);
  if (!std::filesystem::create_directories(folder_, error)) {
    return Unusable(folder_, error.message());
  }
  RETURN_IF_ERROR(task_.write_input(folder_ / "mesh"));
  if (!WriteFile(folder_ / "request", request) || !WriteFile(folder_ / "ticket", NewTicket())) {
    return Unusable(folder_, "a file cannot be written");
  }
  return absl::OkStatus();
}

absl::StatusOr<SlurmJob> SlurmTask::NextSubmission() {
  const std::string ticket = NewTicket();
  if (!WriteFile(folder_ / "ticket", ticket)) return Unusable(folder_, "a file cannot be written");
  job_.ticket = ticket;
  SlurmJob job = job_;
  job.script = Script(folder_, WorkerCommand({.program = options_->program,
                                              .mesh_file = folder_ / "mesh",
                                              .request_file = folder_ / "request",
                                              .model_file = "@model@",
                                              .thread_count = options_->threads_per_job}));
  return job;
}

int SlurmTask::RunCount() const {
  std::error_code ignored;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored)) {
    if (entry.path().filename().string().rfind("begun.", 0) == 0) ++count;
  }
  return count;
}

void SlurmTask::ReadProgress() {
  std::error_code ignored;
  std::vector<worker::v1::WorkerEvent> events;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored)) {
    if (entry.path().filename().string().rfind("events.", 0) != 0) continue;
    const std::vector<worker::v1::WorkerEvent> run = ReadEvents(entry.path());
    if (run.size() > events.size()) events = run;
  }
  if (events.empty() || !events.back().has_progress()) return;
  v1::Progress progress = events.back().progress();
  if (std::isfinite(progress.fraction())) {
    fraction_ = std::max(fraction_, std::min(progress.fraction(), 1.0));
  }
  progress.set_fraction(fraction_);
  std::string bytes = progress.SerializeAsString();
  if (std::exchange(progress_bytes_, bytes) != bytes) task_.on_progress(progress);
}

std::optional<Outcome> SlurmTask::TakeEnd() const {
  std::istringstream end(ReadFile(folder_ / "end"));
  std::string run;
  int status = 0;
  if (!(end >> run >> status)) return std::nullopt;
  const std::vector<worker::v1::WorkerEvent> events =
      ReadEvents(folder_ / absl::StrCat("events.", run));
  const auto reported =
      std::ranges::find_if(events, [](const auto& event) { return event.has_error(); });
  if (status == 0 && reported == events.end()) {
    return Outcome{Verdict::kOk, {}, folder_ / absl::StrCat("model.", run)};
  }
  if (reported != events.end()) {
    return Failure(VerdictOfReport(reported->error().reason()), reported->error());
  }
  if (status == kKilled) return OutOfItsMemory(job_.memory_bytes);
  return Crashed(status > kSignalled ? absl::StrCat("ended by signal ", status - kSignalled)
                                     : absl::StrCat("ended by exit status ", status));
}

std::optional<Outcome> SlurmTask::JudgeLoss(std::optional<SlurmState> state) const {
  if (state == SlurmState::kOutOfMemory && RunCount() == 0) {
    return Failure(Verdict::kCrashed,
                   InternalError("WORKER_NOT_STARTED",
                                 absl::StrCat("the cluster's node could not begin: see that it has "
                                              "the folder ",
                                              folder_.string(), " under this name")));
  }
  if (state == SlurmState::kOutOfMemory) return OutOfItsMemory(job_.memory_bytes);
  if (state == SlurmState::kTimeout) {
    return Failure(
        Verdict::kTimeout,
        InternalError("TIMEOUT",
                      absl::StrCat("the decomposition took more than its ", job_.time_limit_s,
                                   " s: ask for fewer nodes or a lower maximal "
                                   "frequency, or give it more time")));
  }
  if (state == SlurmState::kCancelled) return Failure(Verdict::kCancelled, {});
  if (RunCount() >= kMostRuns) return Crashed("vanished from the cluster three times");
  return std::nullopt;
}

void SlurmTask::Remove() const {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace carillon
