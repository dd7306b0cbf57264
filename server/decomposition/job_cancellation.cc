// SPDX-License-Identifier: Apache-2.0
//
// How QueueCore ends jobs that clients do not want any more.

#include <optional>
#include <string>
#include <utility>

#include "proto/cpp/status_macros.h"
#include "server/decomposition/active_jobs.h"
#include "server/decomposition/job_rules.h"
#include "server/decomposition/queue_core.h"
#include "server/decomposition/watcher.h"

namespace carillon {

// Returns whether other clients still want the job. The job then counts for one of them.
absl::StatusOr<bool> QueueCore::Withdraw(const ActiveJob& active, const std::string& client) {
  const std::string other = active.wishes.OtherThan(client);
  if (other.empty()) return false;
  RETURN_IF_ERROR(database_.jobs().RemoveClient(active.record.digest, client));
  jobs_.Change(active.record.digest, [&](ActiveJob& job) {
    job.wishes.Withdraw(client);
    if (job.client == client) job.client = other;
  });
  return true;
}

absl::StatusOr<v1::Job> QueueCore::Cancel(const std::string& digest,
                                          const std::optional<std::string>& client) {
  Notices notices;
  JobRecord record;
  {
    MutexLock lock(&runs_.writer());
    const std::optional<ActiveJob> active = jobs_.Find(digest);
    if (!active.has_value()) return FindStored(digest);
    if (client.has_value()) {
      RETURN_IF_ERROR(active->wishes.CheckCancel(digest, *client));
      ASSIGN_OR_RETURN(const bool goes_on, Withdraw(*active, *client));
      if (goes_on) return Get(digest);
    }
    // The worker ends first, because the database may take a while.
    if (active->running.has_value()) runs_.Cancel(digest);
    record = active->record;
    record.state = v1::JOB_STATE_CANCELLED;
    RETURN_IF_ERROR(database_.jobs().Put(record));
    if (active->running.has_value()) {
      return jobs_
          .Change(digest,
                  [&](ActiveJob& job) {
                    job.record = record;
                    job.again = false;
                    job.wishes.Clear();
                  })
          .job;
    }
    EndQueued(record, notices);
  }
  TellAll(notices);
  return ToJob(record);
}

absl::Status QueueCore::DeleteModel(const std::string& digest) {
  Notices notices;
  {
    MutexLock lock(&runs_.writer());
    RETURN_IF_ERROR(database_.models().Delete(digest));
    for (const std::string& transfer : jobs_.TransfersOf(digest)) Drop(transfer, notices);
    Drop(digest, notices);
  }
  TellAll(notices);
  return absl::OkStatus();
}

// Ends a job that waits or runs and whose row is no longer in the database.
void QueueCore::Drop(const std::string& digest, Notices& notices) {
  std::optional<ActiveJob> active = jobs_.Find(digest);
  if (!active.has_value()) return;
  active->record.state = v1::JOB_STATE_CANCELLED;
  if (!active->running.has_value()) return EndQueued(active->record, notices);
  runs_.Cancel(digest);
  jobs_.Change(digest, [&](ActiveJob& job) {
    job.record.state = v1::JOB_STATE_CANCELLED;
    job.deleted = true;
    job.again = false;
    job.wishes.Clear();
  });
}

void QueueCore::EndQueued(const JobRecord& record, Notices& notices) {
  notices.push_back(jobs_.Remove(record.digest, ToJob(record)));
  runs_.ReleaseWaiting(record.digest, notices);
  runs_.StartWhatFits(notices);
  for (Notice& news : jobs_.NewsOfWaiting()) notices.push_back(std::move(news));
}

}  // namespace carillon
