// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/local_worker.h"

#include <signal.h>

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/decomposition/job/job_rules.h"
#include "server/decomposition/job/memory_estimate.h"
#include "server/decomposition/worker/oom_kills.h"
#include "server/decomposition/worker/work_folder.h"
#include "server/decomposition/worker/worker_command.h"

namespace carillon {
namespace {

using std::chrono::nanoseconds;

// The niceness of decompositions and of transfers. A processor that another program keeps busy
// gives a quarter of its time to a decomposition, or a tenth to a transfer, so that both end. A
// processor that both use gives three quarters to the decomposition.
constexpr int kDecompositionNice = 5;
constexpr int kTransferNice = 10;

constexpr size_t kReadBytes =
    256 << 10;  // at a time, so that one flooding worker does not hold all
constexpr size_t kLogBytes = 4 << 10;
// The longest time that counts as silence between two looks at a worker. Where a look comes later
// than this, the daemon itself waited for a processor.
constexpr nanoseconds kLongestLook = std::chrono::seconds(1);

double Seconds(nanoseconds time) { return std::chrono::duration<double>(time).count(); }

v1::ErrorInfo OutOfMemory(absl::string_view what) {
  return InternalError(
      "OUT_OF_MEMORY",
      absl::StrCat("the decomposition ", what,
                   ": ask for fewer nodes or a lower maximal frequency, or give the daemon "
                   "more memory"));
}

std::string WouldNeed(uint32_t node_count) {
  if (node_count == 0) return "";
  return absl::StrCat(" (with its ", node_count, " nodes it would need about ",
                      MemoryOfNodes(node_count) >> 20U, " MiB)");
}

// Signals that a process gets from others only, and not by a fault of its own.
bool ComesFromOutside(int signal) {
  return signal == SIGTERM || signal == SIGINT || signal == SIGHUP || signal == SIGQUIT;
}

v1::ErrorInfo EndedFromOutside(int signal, absl::string_view whence) {
  return InternalError(
      "WORKER_CRASHED",
      absl::StrCat("the decomposing process was ended by signal ", signal, " ", whence,
                   ": see who ends processes of this user, and try again"));
}

// The log may hold any bytes; a message is one line of text.
std::string LogSentence(std::string log) {
  if (log.empty()) return "";
  std::ranges::replace_if(
      log, [](char c) { return c < ' ' || c > '~'; }, ' ');
  return absl::StrCat("; the end of its log: ", log);
}

absl::StatusOr<Pipe> MakePipe() {
  ASSIGN_OR_RETURN(Pipe pipe, Pipe::Make());
  RETURN_IF_ERROR(pipe.DoNotWait());
  return pipe;
}

}  // namespace

ScratchFolder::~ScratchFolder() {
  if (path_.empty()) return;  // moved from
  std::error_code ignored;    // what stays is removed when the daemon starts next
  std::filesystem::remove_all(path_, ignored);
}

WorkerLimits WorkerLimits::For(const v1::CreateModalModelRequest& request) const {
  WorkerLimits limits = *this;
  if (request.memory_limit_bytes() > 0) {
    limits.memory_bytes = std::min(limits.memory_bytes, request.memory_limit_bytes());
  }
  if (request.time_limit_s() > 0) {
    const double seconds =
        std::min(request.time_limit_s(), std::chrono::duration<double>(limits.time).count());
    limits.time = std::chrono::duration_cast<nanoseconds>(std::chrono::duration<double>(seconds));
  }
  return limits;
}

absl::StatusOr<PreparedTask> PreparedTask::Make(DecompositionTask task,
                                                const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::remove_all(path, error);
  if (!std::filesystem::create_directory(path, error)) {
    return UnusableWorkFolder(path, error);
  }
  ScratchFolder folder(path);
  RETURN_IF_ERROR(task.write_input(folder / "mesh"));
  RETURN_IF_ERROR(WriteWorkerRequest(task, folder / "request"));
  return PreparedTask{std::move(task), std::move(folder)};
}

absl::StatusOr<LocalWorker> LocalWorker::Start(PreparedTask prepared, const WorkerSystem& system,
                                               const WorkerShare& share, const WorkerLimits& limits,
                                               nanoseconds now) {
  const ScratchFolder& folder = prepared.folder;
  const WorkerPlace place{system.program, folder / "mesh", folder / "request", folder / "model",
                          share.thread_count};
  const WorkerLimits own = limits.For(prepared.task.request);
  const std::optional<uint64_t> oom_kill_count = OomKillCount(system.kernel_counts);
  ASSIGN_OR_RETURN(Pipe events, MakePipe());
  ASSIGN_OR_RETURN(Pipe errors, MakePipe());
  ASSIGN_OR_RETURN(
      ChildProcess process,
      ChildProcess::Start(
          {.words = WorkerCommand(place),
           .errors = errors.write_end(),
           .events = events.write_end(),
           .worker_processor_count = share.processor_count,
           .worker_nice = prepared.task.radiates ? kTransferNice : kDecompositionNice}));
  events.CloseWriteEnd();
  errors.CloseWriteEnd();
  LocalWorker worker(std::move(prepared), std::move(events), std::move(errors), std::move(process),
                     own, now);
  worker.kernel_counts_ = system.kernel_counts;
  worker.earlier_oom_kill_count_ = oom_kill_count;
  return worker;
}

void LocalWorker::Read(nanoseconds now) {
  const absl::Status status =
      events_.Feed(event_pipe_.Read(kReadBytes),
                   [&](const worker::v1::WorkerEvent& event) { OnEvent(event, now); });
  if (!status.ok()) Kill(Verdict::kCrashed, ToErrorInfo(status));
  log_ += error_pipe_.Read(kReadBytes);
  if (log_.size() > kLogBytes) log_.erase(0, log_.size() - kLogBytes);
}

void LocalWorker::OnEvent(const worker::v1::WorkerEvent& event, nanoseconds now) {
  last_look_ = now;
  silence_ = {};
  if (event.has_error()) {
    reported_ = event.error();
  } else {
    OnProgress(event.progress());
  }
}

void LocalWorker::OnProgress(v1::Progress progress) {
  if (std::isfinite(progress.fraction())) {
    fraction_ = std::max(fraction_, std::min(progress.fraction(), 1.0));
  }
  progress.set_fraction(fraction_);
  progress.set_memory_bytes(resident_bytes_);
  node_count_ = std::max(node_count_, progress.node_count());
  task_.on_progress(progress);
}

void LocalWorker::CountSilence(nanoseconds now) {
  const nanoseconds passed = std::min(now - std::exchange(last_look_, now), kLongestLook);
  const nanoseconds before = std::exchange(processor_time_, process_.ProcessorTime());
  silence_ +=
      process_.Sleeps() ? passed : std::clamp(processor_time_ - before, nanoseconds(0), passed);
}

uint64_t LocalWorker::Enforce(nanoseconds now) {
  CountSilence(now);
  resident_bytes_ = process_.ResidentBytes();
  peak_bytes_ = std::max(peak_bytes_, resident_bytes_);
  if (resident_bytes_ > limits_.memory_bytes) {
    Kill(Verdict::kOutOfMemory,
         OutOfMemory(absl::StrCat("took more than its ", limits_.memory_bytes >> 20U, " MiB",
                                  WouldNeed(node_count_))));
  } else if (now - started_ > limits_.time) {
    Kill(Verdict::kTimeout,
         InternalError("TIMEOUT",
                       absl::StrCat("the decomposition took more than its ", Seconds(limits_.time),
                                    " s: ask for fewer nodes or a lower maximal frequency, or "
                                    "give it more time")));
  } else if (silence_ > limits_.stall) {
    Kill(
        Verdict::kStalled,
        InternalError(
            "WORKER_STALLED",
            absl::StrCat("the decomposing process gave no sign of life in ", Seconds(limits_.stall),
                         " s in which it could have: try again; if it stalls again, report it with "
                         "the mesh")));
  }
  return resident_bytes_;
}

void LocalWorker::MakeRoom(uint64_t budget_bytes) {
  if (killed_.has_value()) return;
  Kill(Verdict::kOutOfMemory,
       OutOfMemory(absl::StrCat("and others took more than the ", budget_bytes >> 20U,
                                " MiB of all together")));
  killed_->crowded = true;
}

void LocalWorker::Kill(Verdict verdict, v1::ErrorInfo error) {
  if (killed_.has_value()) return;
  killed_ = Outcome{verdict, std::move(error), {}};
  process_.Kill();
}

std::optional<Outcome> LocalWorker::TakeOutcome(nanoseconds now) {
  const std::optional<ProcessEnd> end = process_.Reap();
  if (!end.has_value()) return std::nullopt;
  Read(now);  // the output before its end
  Outcome outcome = Judge(*end);
  outcome.peak_bytes = peak_bytes_;
  return outcome;
}

Outcome LocalWorker::Judge(const ProcessEnd& end) const {
  if (killed_.has_value()) return *killed_;
  const bool success = end.exited && end.status == 0 && !reported_.has_value();
  if (!success) return JudgeFailure(end);
  return {Verdict::kOk, {}, folder_ / "model"};
}

Outcome LocalWorker::JudgeKill() const {
  const std::optional<uint64_t> count = OomKillCount(kernel_counts_);
  Outcome outcome;
  outcome.killed = true;
  if (count.has_value() && count > earlier_oom_kill_count_) {
    outcome.verdict = Verdict::kOutOfMemory;
    outcome.error = OutOfMemory(
        absl::StrCat("was killed by the system for lack of memory", WouldNeed(node_count_)));
  } else {
    outcome.error = EndedFromOutside(
        SIGKILL, count.has_value()
                     ? "from outside, and not by the kernel for lack of memory"
                     : "from outside, by the kernel for lack of memory or by somebody else");
  }
  return outcome;
}

Outcome LocalWorker::JudgeFailure(const ProcessEnd& end) const {
  if (!end.exited && end.status == SIGKILL) return JudgeKill();
  if (!end.exited && ComesFromOutside(end.status)) {
    Outcome outcome{Verdict::kCrashed, EndedFromOutside(end.status, "from outside"), {}};
    outcome.killed = true;
    return outcome;
  }
  if (end.exited && reported_.has_value()) {
    return {VerdictOfReport(reported_->reason()), *reported_, {}};
  }
  return {Verdict::kCrashed,
          InternalError(
              "WORKER_CRASHED",
              absl::StrCat("the decomposing process ended by ",
                           end.exited ? "exit status " : "signal ", end.status, LogSentence(log_),
                           ": check the mesh for faults such as crossing or doubled triangles")),
          {}};
}

}  // namespace carillon
