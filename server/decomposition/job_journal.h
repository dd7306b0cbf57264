// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "server/decomposition/job/memory_estimate.h"
#include "server/decomposition/job_events.h"
#include "server/decomposition/job_wishes.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// Writes what happens to jobs into the database, so that the next daemon goes on with them. The
/// database has running jobs as JOB_STATE_QUEUED, too. Its rows are the caller's promise to
/// clients where Put, AddClient or RemoveClient succeeded. The Note calls write what the queue can
/// do without: an error is logged as the event `job_not_stored`, and nothing else happens. Every
/// call waits for the disk. Safe from every thread.
class JobJournal {
 public:
  /// `database` and `events` must outlive the journal.
  JobJournal(ModeDatabase& database, JobEvents& events) : database_(database), events_(events) {}

  /// Writes a job durably, and notes the clients that want it; see JobStore::Put.
  absl::Status Put(const JobRecord& record, const std::vector<std::string>& clients = {}) {
    return database_.jobs().Put(record, clients);
  }
  absl::Status AddClient(const std::string& digest, const std::string& client) {
    return database_.jobs().AddClient(digest, client);
  }
  absl::Status RemoveClient(const std::string& digest, const std::string& client) {
    return database_.jobs().RemoveClient(digest, client);
  }

  /// Writes the start of a job, or a change of its clients. Without it, the next daemon counts one
  /// start less.
  void Note(const JobRecord& record, const std::vector<std::string>& clients = {});

  /// Copies the coarse model `from` to the name of the job that waits for it, which otherwise goes
  /// without.
  void NoteCoarseModel(const std::string& from, const std::string& to, const std::string& label);

  /// Writes the correction of memory estimates, which the next daemon otherwise learns anew.
  void NoteExperience(const MemoryExperience& experience);

  /// Returns what NoteExperience wrote, or no correction.
  MemoryExperience ReadExperience();

  /// Returns the clients that want a job. Wishes that cannot be read leave a job that only callers
  /// with the role administer may cancel.
  JobWishes ReadWishes(const std::string& digest);

 private:
  ModeDatabase& database_;
  JobEvents& events_;
};

}  // namespace carillon
