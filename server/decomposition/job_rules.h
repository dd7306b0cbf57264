// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/wanted_job.h"
#include "server/mode_database/job_store.h"

namespace carillon {

// The functions in this file decide what the queue does with a job: whether it computes, retries or
// repeats the job, and how clients see it. They keep no state.

v1::Job ToJob(const JobRecord& record);

/// The record of a job that waits to run for the first time.
JobRecord NewRecord(const WantedJob& wanted, int64_t now_unix_ms);

/// The request of a job. Errors: DataLoss (DATABASE_CORRUPT).
absl::StatusOr<v1::CreateModalModelRequest> ParseRequest(const JobRecord& record);

/// Whether both requests want the same band of eigenvalues, and both or neither leave it open.
bool SameHints(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b);

/// Whether `a` wants modes that a job for `b` may leave out: those up to a higher eigenvalue, or
/// the same ones whatever they cost.
bool WantsMore(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b);

/// Whether a refusal depends on the band, so that a request with other hints may succeed.
bool DependsOnHints(const std::string& reason);

/// Whether the job has failed for a reason that would recur with this request.
bool WouldFailAgain(const JobRecord& record, const v1::CreateModalModelRequest& request);

/// Whether another way of computing may succeed, because the mesher or the worker crashed.
bool DependsOnWay(const Outcome& outcome);

/// Whether the same request would end in the same way again on any machine.
bool IsDeterministic(const Outcome& outcome);

/// The verdict on a worker that reported an error with this reason.
Verdict VerdictOfReport(const std::string& reason);

v1::JobState StateOf(Verdict verdict);

bool HasEnded(v1::JobState state);

/// Whether a job as clients see it passes the filter.
bool Matches(const v1::Job& job, const JobFilter& filter);

/// An error with the given reason whose cause lies on the server's side.
v1::ErrorInfo InternalError(absl::string_view reason, absl::string_view message);

/// The error of a job during which the daemon was killed so often that the job may be the cause.
v1::ErrorInfo GaveUp(uint32_t start_count);

}  // namespace carillon
