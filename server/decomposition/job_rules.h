// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/decomposition/executor.h"
#include "server/mode_database/job_store.h"

namespace carillon {

/// What follows from how a decomposition ended: rules without state.

v1::Job ToJob(const JobRecord& record);

/// What a job asked for. Errors: DataLoss (DATABASE_CORRUPT).
absl::StatusOr<v1::CreateModalModelRequest> ParseRequest(const JobRecord& record);

/// Whether both want the same eigenvalues.
bool SameHints(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b);

/// Whether a refusal has to do with the band, so that other hints may have other luck.
bool DependsOnHints(const std::string& reason);

/// Whether the job has failed for a reason that would come again with this request.
bool WouldFailAgain(const JobRecord& record, const v1::CreateModalModelRequest& request);

/// Whether another way of computing may end better: the mesher or the worker came to grief.
bool DependsOnWay(const Outcome& outcome);

/// Whether the same request would end so again, whatever the machine does meanwhile.
bool IsDeterministic(const Outcome& outcome);

/// What a worker's own report of failure means.
Verdict VerdictOfReport(const std::string& reason);

v1::JobState StateOf(Verdict verdict);

bool HasEnded(v1::JobState state);

/// What follows after a daemon died under the job so often that it may be the job's doing.
v1::ErrorInfo GaveUp(uint32_t start_count);

}  // namespace carillon
