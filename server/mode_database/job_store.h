// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon {

class Database;

/// A job as it is stored.
struct JobRecord {
  std::string digest{};  ///< the modal model's, or of a job that computes a transfer its own
  /// Digest of the modal model whose transfer the job computes; empty: it computes a model.
  std::string transfer_of{};
  std::string request{};  ///< serialized by the caller, who alone interprets it
  std::string label{};
  v1::JobState state = v1::JOB_STATE_QUEUED;
  v1::ErrorInfo error{};  ///< while `state` is JOB_STATE_FAILED
  /// The job has failed, and the same request would fail again: it is refused with `error`, and is
  /// not run again.
  bool remembered = false;
  int64_t created_unix_ms = 0;
  int32_t priority = 0;      ///< higher starts first
  uint32_t start_count = 0;  ///< workers started since the last submit that have not ended
  uint32_t way = 0;          ///< 0: computed as requested; above: by another way, see kWayCount
  uint64_t peak_bytes = 0;   ///< peak memory of its worker; 0: none has ended yet
  /// The row has changed on the disk: only `digest` is right, and `state` and `error` report it.
  bool damaged = false;
};

/// The jobs that a list is to have.
struct JobFilter {
  std::vector<v1::JobState> states{};  ///< none: any
  std::string label_contains{};        ///< in upper or lower case; empty: any
};

struct JobPage {
  std::vector<JobRecord> jobs;
  std::string next_page_token;  ///< empty: this was the last page
};

/// Jobs by digest, so that they outlive the daemon. Safe from every thread.
class JobStore {
 public:
  explicit JobStore(Database& database) : database_(&database) {}

  /// Writes a job, durably; replaces one of the same digest.
  absl::Status Put(const JobRecord& job);

  absl::StatusOr<std::optional<JobRecord>> Find(const std::string& digest);

  /// Queued, running and damaged jobs, oldest first.
  absl::StatusOr<std::vector<JobRecord>> Unfinished();

  /// Newest first. `page_size` 0: 100; at most 1000. Errors: InvalidArgument (INVALID_PAGE).
  absl::StatusOr<JobPage> List(int page_size, const std::string& page_token,
                               const JobFilter& filter = {});

  /// Deleting a job that is not there is no error.
  absl::Status Delete(const std::string& digest);

  /// A named value that the daemon learnt from jobs; absent until it is first stored.
  absl::StatusOr<std::optional<std::string>> Fact(const std::string& name);
  absl::Status PutFact(const std::string& name, const std::string& value);

 private:
  Database* database_;
};

}  // namespace carillon
