// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "server/base/clock.h"
#include "server/base/event.h"
#include "server/base/limited_events.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/model_store.h"

namespace carillon {

/// Logs the failures and results of jobs. Untrusted clients cannot flood the log with jobs that end
/// at once, because failures, results and refusals of the database are limited, each by itself.
/// Safe from every thread.
class JobEvents {
 public:
  /// `clock` must outlive the object.
  JobEvents(const Clock& clock, const EventSink& sink)
      : sink_(sink),
        failures_(clock, "failed_jobs", sink),
        results_(clock, "stored_models", sink),
        unstored_(clock, "jobs_not_stored", sink) {}

  /// Logs a job that failed with `job.error`. `client` asked for it.
  void LogFailure(const JobRecord& job, const std::string& client);

  /// Logs the model that a job computed and the database has stored.
  void LogModel(const ModelSummary& model);

  /// Logs that the job has stored a transfer of its model.
  void LogTransfer(const JobRecord& job);

  /// Logs that a model was deleted which its job stored at the time at which an administrator
  /// deleted it.
  void LogDeletedResult(const std::string& digest);

  /// Logs that the database refused `what` of a job, which the queue can do without. Logs nothing
  /// if `status` is OK.
  void LogUnstored(const std::string& what, const std::string& digest, const absl::Status& status);

 private:
  const EventSink sink_;
  LimitedEvents failures_;
  LimitedEvents results_;
  LimitedEvents unstored_;
};

}  // namespace carillon
