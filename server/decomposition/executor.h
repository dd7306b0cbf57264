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

/// How a decomposition ended.
enum class Verdict {
  kOk,
  kBadInput,  ///< the worker refused it and would refuse it again
  kCrashed,   ///< it died, or said what no worker says
  kOutOfMemory,
  kStalled,  ///< no event for too long
  kTimeout,
  kCancelled,
};

struct Outcome {
  Verdict verdict = Verdict::kCrashed;
  v1::ErrorInfo error;               ///< unless kOk
  std::filesystem::path model_file;  ///< if kOk: the stored form, there until on_end returns
  uint64_t peak_bytes = 0;           ///< most memory that it was seen to take; 0: not known
  /// With kOutOfMemory: it was within its own limit, but all together were not. Alone it may do.
  bool crowded = false;
};

/// One decomposition to run. The functions are called on a thread of the executor, never two calls
/// for one task at a time. The limits of its request bind, where they are below the executor's own.
struct DecompositionTask {
  std::string digest;                   ///< names the task; no two run at a time under one digest
  v1::CreateModalModelRequest request;  ///< resolved
  uint32_t way = 0;                     ///< as JobRecord::way
  uint64_t estimate_bytes = 0;          ///< of the memory that it will take
  /// Brings the mesh to where the worker reads it.
  std::function<absl::Status(const std::filesystem::path& file)> write_mesh;
  std::function<void(const v1::Progress&)> on_progress;
  std::function<void(const Outcome&)> on_end;  ///< once, last
};

/// Runs decompositions somewhere: in processes of this machine, or on a cluster. Its destructor
/// ends what runs without calling on_end. Safe from every thread.
class Executor {
 public:
  virtual ~Executor() = default;

  /// Tasks that it runs at a time; the caller starts no more.
  virtual int worker_count() const = 0;

  /// Memory for all tasks that run at a time, bytes; the caller starts no more than are estimated
  /// to fit, but one always.
  virtual uint64_t memory_budget_bytes() const = 0;

  virtual void Start(DecompositionTask task) = 0;

  /// The task ends as kCancelled, or as whatever it became before the call reached it.
  virtual void Cancel(const std::string& digest) = 0;
};

}  // namespace carillon
