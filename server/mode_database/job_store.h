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

/// A decomposition job as it is stored.
struct JobRecord {
  std::string digest{};   ///< the modal model's
  std::string request{};  ///< what was asked for; bytes whose meaning belongs to the caller
  std::string label{};
  v1::JobState state = v1::JOB_STATE_QUEUED;
  v1::ErrorInfo error{};    ///< while `state` is JOB_STATE_FAILED
  bool remembered = false;  ///< the failure would come again: it is not tried again
  int64_t created_unix_ms = 0;
  int32_t priority = 0;      ///< higher starts first
  uint32_t start_count = 0;  ///< starts of a worker since it was last asked for, that saw no end
  uint32_t way = 0;          ///< how it is computed: 0 as asked, above that another way
  uint64_t peak_bytes = 0;   ///< most memory that its worker took, once it ran
  /// The row has changed on the disk: only its digest is right, `state` and `error` say so.
  bool damaged = false;
};

struct JobPage {
  std::vector<JobRecord> jobs;
  std::string next_page_token;  ///< empty: this was the last page
};

/// Decomposition jobs by digest: the intent that outlives the daemon. Safe from every thread.
class JobStore {
 public:
  explicit JobStore(Database& database) : database_(&database) {}

  /// Writes a job, durably; replaces one of the same digest.
  absl::Status Put(const JobRecord& job);

  absl::StatusOr<std::optional<JobRecord>> Find(const std::string& digest);

  /// Queued, running and damaged jobs, oldest first.
  absl::StatusOr<std::vector<JobRecord>> Unfinished();

  /// Newest first. `page_size` 0: 100; at most 1000. Errors: InvalidArgument (INVALID_PAGE).
  absl::StatusOr<JobPage> List(int page_size, const std::string& page_token);

  /// Deleting a job that is not there is no error.
  absl::Status Delete(const std::string& digest);

  /// A figure that is learnt from jobs, under a name; absent before it was first stored.
  absl::StatusOr<std::optional<std::string>> Fact(const std::string& name);
  absl::Status PutFact(const std::string& name, const std::string& value);

 private:
  Database* database_;
};

}  // namespace carillon
