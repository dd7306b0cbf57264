// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/job/wanted_job.h"
#include "server/mode_database/job_store.h"

namespace carillon {

// The functions in this file decide what the queue does with a job: whether it computes, retries or
// repeats the job, and how clients see it. They keep no state.

v1::JobKind KindOf(const JobRecord& record);

v1::Job ToJob(const JobRecord& record);

/// Returns the record of a job that waits to run for the first time.
JobRecord NewRecord(const WantedJob& wanted, int64_t now_unix_ms);

/// Returns the request of a job. Errors: DataLoss (DATABASE_CORRUPT).
absl::StatusOr<v1::CreateModalModelRequest> ParseRequest(const JobRecord& record);

/// Returns whether both requests want the same band of eigenvalues, and either both or neither
/// leave its upper end open.
bool SameHints(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b);

/// Returns whether a request states the unit of its mesh file, so that a large body is computed.
bool StatesUnit(const v1::CreateModalModelRequest& request);

/// Returns whether `a` wants modes that a job for `b` may leave out, because the band of `a` ends
/// higher, or because both bands end alike and only that of `b` is open, or only `a` states a unit.
bool WantsMore(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b);

/// Returns whether a refusal for this reason depends on the hints, so that a request with others
/// may succeed.
bool DependsOnHints(const std::string& reason);

/// Returns whether the job has failed for a reason that would recur with this request.
bool WouldFailAgain(const JobRecord& record, const v1::CreateModalModelRequest& request);

/// Returns whether the mesher or the worker crashed, so that another way of computing may succeed.
bool DependsOnWay(const Outcome& outcome);

/// Returns whether the same request would end with this outcome on any machine.
bool IsDeterministic(const Outcome& outcome);

/// Returns the verdict on a worker that reported an error with this reason.
Verdict VerdictOfReport(const std::string& reason);

v1::JobState StateOf(Verdict verdict);

bool HasEnded(v1::JobState state);

/// Returns whether a job, as clients see it, passes the filter.
bool Matches(const v1::Job& job, const JobFilter& filter);

/// Returns an error with this reason, whose cause lies on the server's side.
v1::ErrorInfo InternalError(absl::string_view reason, absl::string_view message);

/// Returns the error of a job that may be the cause of the daemon's death, because the daemon was
/// killed `start_count` times while the job ran.
v1::ErrorInfo GaveUp(uint32_t start_count);

}  // namespace carillon
