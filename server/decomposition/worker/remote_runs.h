// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/transfer.pb.h"
#include "carillon/worker/v1/job_run_service.pb.h"
#include "server/base/mutex.h"

namespace carillon {

class RemoteRuns;

/// Receives the result of one run. A result that does not arrive completely is dropped. Only one
/// thread at a time may use an object.
class RunUpload {
 public:
  RunUpload(RunUpload&&) noexcept;
  RunUpload& operator=(RunUpload&&) noexcept;
  ~RunUpload();

  /// Appends to the result of a job that computes a model. Errors: InvalidArgument
  /// (MODAL_MODEL_MALFORMED), DataLoss (MODAL_MODEL_CORRUPT), ResourceExhausted (DATABASE_FULL).
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Appends to the result of a job that computes a transfer. Errors: ResourceExhausted
  /// (DATABASE_FULL).
  absl::Status Append(const v1::TransferRecord& record);

  /// Ends the run. When Finish returns, the result is on the disk and accepted, and the run's token
  /// is invalid. Finish must be the last call. Errors: those of Append and of RemoteRuns,
  /// InvalidArgument (TRANSFER_MALFORMED), DataLoss (TRANSFER_CORRUPT).
  absl::Status Finish(const worker::v1::RunEnd& end);

 private:
  friend class RemoteRuns;
  struct State;
  explicit RunUpload(std::unique_ptr<State> state);
  absl::Status WriteResult(const std::string& bytes);
  absl::Status CheckWhole() const;

  std::unique_ptr<State> state_;
};

/// Runs of jobs on machines that share no folder with this one. Each run shows a token, of which
/// the daemon keeps only the hash. A token is valid for one submission of one job, until the job
/// has ended or has a result. Results go into the job's folder, which slurm_task.h describes.
/// Errors of every call with a token: PermissionDenied (JOB_TOKEN_WRONG), FailedPrecondition
/// (JOB_TOKEN_EXPIRED). Safe from every thread.
class RemoteRuns {
 public:
  /// Returns a token that nobody can guess.
  static std::string NewToken();

  /// Returns the hash of a token and the digest of its job, which the daemon keeps.
  static std::string HashOf(const std::string& digest, const std::string& token);

  /// Admits the run whose token has this hash, and from then on no other run of the job.
  void Admit(const std::string& digest, const std::filesystem::path& folder,
             const std::string& token_hash);

  /// Refuses all runs of the job from then on.
  void Dismiss(const std::string& digest);

  /// Notes that a run has begun. Returns the path of its mesh file.
  absl::StatusOr<std::filesystem::path> Begin(const std::string& digest, const std::string& token);

  absl::Status Report(const std::string& digest, const std::string& token,
                      const v1::Progress& progress);

  absl::StatusOr<RunUpload> BeginUpload(const std::string& digest, const std::string& token);

 private:
  friend class RunUpload;
  struct Place {
    std::filesystem::path folder;
    std::string token_hash;
    std::set<std::string> past_hashes;
  };

  absl::StatusOr<std::filesystem::path> FolderOf(const std::string& digest,
                                                 const std::string& token)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Mutex mutex_;
  std::map<std::string, Place> places_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
