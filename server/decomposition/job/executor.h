// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// How a task ended.
enum class Verdict {
  kOk,
  kBadInput,  ///< the worker refused the request and would refuse it again
  kCrashed,   ///< the worker died, or broke the protocol of its events
  kOutOfMemory,
  kStalled,  ///< the worker sent no event for too long, though it had the processor
  kTimeout,
  kCancelled,
};

struct Outcome {
  Verdict verdict = Verdict::kCrashed;
  v1::ErrorInfo error{};               ///< empty if kOk
  std::filesystem::path model_file{};  ///< the stored form if kOk; exists until on_end returns
  uint64_t peak_bytes = 0;             ///< highest observed memory; 0 if unknown
  /// Set with kOutOfMemory if the worker kept to its own limit, but all workers together exceeded
  /// the budget. The task may succeed if it runs alone.
  bool crowded = false;
  /// Set if somebody else ended the worker. With kOutOfMemory the kernel has killed a process for
  /// lack of memory while the worker ran, and this one was the first to be killed. With kCrashed it
  /// has killed none, or its count cannot be read, or the signal was one that it does not send.
  bool killed = false;
};

/// One decomposition to run, or one transfer to compute. Threads of the executor call its
/// functions, one call at a time for each task. A limit of the request applies if it is below the
/// executor's own limit.
struct DecompositionTask {
  std::string digest;  ///< names the task; tasks with the same digest must not run at the same time
  bool radiates = false;  ///< whether to compute the transfer of a stored model, and not a model
  v1::CreateModalModelRequest request;  ///< resolved
  uint32_t way = 0;                     ///< see JobRecord::way
  uint64_t estimate_bytes = 0;          ///< predicted memory
  /// Writes the mesh, or the stored model, to the file that the worker reads.
  std::function<absl::Status(const std::filesystem::path& file)> write_input;
  std::function<void(const v1::Progress&)> on_progress;
  std::function<void(const Outcome&)> on_end;  ///< the last call, made exactly once
};

/// Runs tasks, in processes of this machine or on a cluster. The destructor ends running
/// tasks without a call of on_end. Safe from every thread.
class Executor {
 public:
  virtual ~Executor() = default;

  /// Returns the number of tasks that may run at a time, besides transfers that yield.
  virtual int worker_count() const = 0;

  /// Returns whether transfers leave the processors to decompositions, so that a decomposition may
  /// run in addition to as many transfers as there are workers.
  virtual bool transfers_yield() const = 0;

  /// Returns the memory for all running tasks together, bytes. The caller starts further tasks only
  /// if the estimates of all running tasks fit into this budget.
  virtual uint64_t memory_budget_bytes() const = 0;

  virtual void Start(DecompositionTask task) = 0;

  /// Ends the task as kCancelled, unless it has ended before.
  virtual void Cancel(const std::string& digest) = 0;
};

}  // namespace carillon
