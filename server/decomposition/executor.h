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
  kStalled,  ///< the worker sent no event for too long
  kTimeout,
  kCancelled,
};

struct Outcome {
  Verdict verdict = Verdict::kCrashed;
  v1::ErrorInfo error;               ///< unless kOk
  std::filesystem::path model_file;  ///< if kOk: the stored form; it exists until on_end returns
  uint64_t peak_bytes = 0;           ///< highest memory that was observed; 0: unknown
  /// With kOutOfMemory: the worker kept its own limit, but all workers together exceeded the
  /// budget. It may succeed alone.
  bool crowded = false;
};

/// One decomposition to run, or one transfer to compute. The functions are called on threads of the
/// executor, one call for a task at a time. A limit of the request applies if it is below the
/// executor's own.
struct DecompositionTask {
  std::string digest;     ///< names the task; at most one task of a digest runs at a time
  bool radiates = false;  ///< computes the transfer of a stored model, not a model
  v1::CreateModalModelRequest request;  ///< resolved
  uint32_t way = 0;                     ///< as JobRecord::way
  uint64_t estimate_bytes = 0;          ///< predicted memory
  /// Writes the mesh, or the stored model, to the file that the worker reads.
  std::function<absl::Status(const std::filesystem::path& file)> write_input;
  std::function<void(const v1::Progress&)> on_progress;
  std::function<void(const Outcome&)> on_end;  ///< once, last
};

/// Runs tasks, in processes of this machine or on a cluster. The destructor ends running
/// tasks without a call of on_end. Safe from every thread.
class Executor {
 public:
  virtual ~Executor() = default;

  /// The number of tasks that the caller may have running at a time.
  virtual int worker_count() const = 0;

  /// Memory for all running tasks together, bytes. The caller starts only tasks whose estimates fit
  /// into it, or a single one.
  virtual uint64_t memory_budget_bytes() const = 0;

  virtual void Start(DecompositionTask task) = 0;

  /// The task ends as kCancelled, unless it ended otherwise before the call reached it.
  virtual void Cancel(const std::string& digest) = 0;
};

}  // namespace carillon
