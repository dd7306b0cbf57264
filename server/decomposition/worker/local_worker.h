// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/worker/v1/worker.pb.h"
#include "proto/cpp/program/child_process.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/worker/worker_events.h"

namespace carillon {

/// Removes a folder and its content when it goes out of scope.
class ScratchFolder {
 public:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}
  ScratchFolder(ScratchFolder&& other) noexcept { path_.swap(other.path_); }
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ~ScratchFolder();

  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Limits beyond which a worker is killed.
struct WorkerLimits {
  uint64_t memory_bytes = 0;
  std::chrono::nanoseconds time{};
  /// Without an event, of the time in which the worker computes or sleeps. The time in which it
  /// waits for a processor or the disk does not count, because others take them on a busy machine.
  std::chrono::nanoseconds stall{};

  /// Returns these limits, with memory and time lowered to the request's limits if those are lower.
  WorkerLimits For(const v1::CreateModalModelRequest& request) const;
};

/// Where a worker's program and the kernel's counts are.
struct WorkerSystem {
  std::filesystem::path program;
  std::filesystem::path kernel_counts;  ///< see OomKillCount
};

/// The share of the processors that a worker gets.
struct WorkerShare {
  int thread_count = 1;
  int processor_count = 1;  ///< shared by all workers; see ChildCommand
};

/// A task with its mesh in a folder of its own, ready to be started.
struct PreparedTask {
  /// Makes the folder `path` and writes the mesh into it.
  /// Errors: those of write_input, FailedPrecondition (WORK_FOLDER_UNUSABLE).
  static absl::StatusOr<PreparedTask> Make(DecompositionTask task,
                                           const std::filesystem::path& path);

  DecompositionTask task;
  ScratchFolder folder;
};

/// One running decomposition: its process, its events and the verdict on it. The destructor kills
/// the process and removes the folder. Only one thread at a time may use an object.
class LocalWorker {
 public:
  /// Starts the program. Errors: those of ChildProcess::Start.
  static absl::StatusOr<LocalWorker> Start(PreparedTask prepared, const WorkerSystem& system,
                                           const WorkerShare& share, const WorkerLimits& limits,
                                           std::chrono::nanoseconds now);
  const DecompositionTask& task() const { return task_; }

  /// Returns descriptors that become readable when the process has ended, or when Read would find
  /// an event or a line of the log. A descriptor is -1 if no more input comes from it.
  std::array<int, 3> descriptors() const {
    return {process_.descriptor(), event_pipe_.read_end(), error_pipe_.read_end()};
  }

  /// Reads the output of the process. An event counts as a sign of life at `now`.
  void Read(std::chrono::nanoseconds now);

  /// Kills the process if it exceeds a limit. Returns the resident memory of the process, bytes.
  uint64_t Enforce(std::chrono::nanoseconds now);

  void Cancel() { Kill(Verdict::kCancelled, {}); }

  /// Kills the process because all workers together exceed `budget_bytes`.
  void MakeRoom(uint64_t budget_bytes);

  /// Returns the outcome once the process has ended.
  std::optional<Outcome> TakeOutcome(std::chrono::nanoseconds now);

 private:
  LocalWorker(PreparedTask prepared, Pipe events, Pipe errors, ChildProcess process,
              const WorkerLimits& limits, std::chrono::nanoseconds now)
      : task_(std::move(prepared.task)),
        folder_(std::move(prepared.folder)),
        event_pipe_(std::move(events)),
        error_pipe_(std::move(errors)),
        process_(std::move(process)),
        limits_(limits),
        started_(now),
        last_look_(now) {}

  void OnEvent(const worker::v1::WorkerEvent& event, std::chrono::nanoseconds now);
  void OnProgress(v1::Progress progress);
  void CountSilence(std::chrono::nanoseconds now);
  void Kill(Verdict verdict, v1::ErrorInfo error);
  Outcome Judge(const ProcessEnd& end) const;
  Outcome JudgeFailure(const ProcessEnd& end) const;
  Outcome JudgeKill() const;

  DecompositionTask task_;
  ScratchFolder folder_;  // destroyed after the process
  Pipe event_pipe_;
  Pipe error_pipe_;
  ChildProcess process_;
  WorkerLimits limits_;
  std::filesystem::path kernel_counts_;
  std::optional<uint64_t> earlier_oom_kill_count_;  // when the process was started
  uint64_t resident_bytes_ = 0;                     // newest measurement
  uint64_t peak_bytes_ = 0;
  uint32_t node_count_ = 0;
  std::chrono::nanoseconds started_;
  std::chrono::nanoseconds last_look_;         // of CountSilence, or the newest event
  std::chrono::nanoseconds processor_time_{};  // of the process at the last CountSilence
  std::chrono::nanoseconds silence_{};         // since the newest event; see WorkerLimits::stall
  WorkerEventReader events_;
  std::string log_;  // the end of the process's standard error
  double fraction_ = 0;
  std::optional<v1::ErrorInfo> reported_;  // error that the worker itself reported
  std::optional<Outcome> killed_;          // the outcome if this class killed it
};

}  // namespace carillon
