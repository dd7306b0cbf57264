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
  std::string digest{};  ///< the modal model's; a job that computes a transfer has its own digest
  /// Digest of the modal model whose transfer the job computes; empty if the job computes a model.
  std::string transfer_of{};
  std::string request{};  ///< serialized by the caller; the store does not read it
  std::string label{};
  v1::JobState state = v1::JOB_STATE_QUEUED;
  v1::ErrorInfo error{};  ///< while `state` is JOB_STATE_FAILED
  /// Whether the job has failed so that the same request would fail again. Such a request is
  /// refused with `error` and not run again.
  bool remembered = false;
  int64_t created_unix_ms = 0;
  int32_t priority = 0;      ///< higher starts first
  uint32_t start_count = 0;  ///< starts of workers since the last submission or end of a worker
  uint32_t way = 0;          ///< 0 if computed as requested, else see kWayCount
  uint64_t peak_bytes = 0;   ///< peak memory of the job's worker; 0 until a worker has ended
  /// Whether the row was damaged on the disk. Only `digest` is then valid; `state` and `error`
  /// report the damage.
  bool damaged = false;
};

/// Selects the jobs of a list.
struct JobFilter {
  std::vector<v1::JobState> states{};  ///< if empty, jobs in all states
  std::string label_contains{};        ///< in upper or lower case; if empty, all jobs
};

struct JobPage {
  std::vector<JobRecord> jobs;
  std::string next_page_token;  ///< empty after the last page
};

/// Stores jobs by digest, so that they outlive the daemon. Safe from every thread.
class JobStore {
 public:
  explicit JobStore(Database& database) : database_(&database) {}

  /// Writes a job durably, and replaces a job with the same digest. Adds `clients` to those that
  /// want it; a client without a name is not noted. All clients of a job that has ended are
  /// forgotten.
  absl::Status Put(const JobRecord& job, const std::vector<std::string>& clients = {});

  /// Notes durably that a client wants a job. It is no error if there is no such job.
  absl::Status AddClient(const std::string& digest, const std::string& client);

  /// Notes durably that a client does not want a job any more.
  absl::Status RemoveClient(const std::string& digest, const std::string& client);

  /// Returns the clients that want a job.
  absl::StatusOr<std::vector<std::string>> Clients(const std::string& digest);

  absl::StatusOr<std::optional<JobRecord>> Find(const std::string& digest);

  /// Returns the queued, running and damaged jobs, oldest first.
  absl::StatusOr<std::vector<JobRecord>> Unfinished();

  /// Returns the jobs newest first, up to 1000 a page; a `page_size` of 0 means 100. Errors:
  /// InvalidArgument (INVALID_SETTINGS).
  absl::StatusOr<JobPage> List(int page_size, const std::string& page_token,
                               const JobFilter& filter = {});

  /// Deletes a job. It is not an error if the job does not exist.
  absl::Status Delete(const std::string& digest);

  /// Returns the value that PutFact stored under `name`, or nothing if there is none. The daemon
  /// stores values here that it measures on finished jobs.
  absl::StatusOr<std::optional<std::string>> Fact(const std::string& name);
  absl::Status PutFact(const std::string& name, const std::string& value);

 private:
  Database* database_;
};

}  // namespace carillon
