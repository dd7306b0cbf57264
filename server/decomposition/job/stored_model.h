// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/decomposition/job/wanted_job.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/model_store.h"

namespace carillon {

/// Functions that compare stored models and transfers with those that a job is to compute.

/// Returns whether the stored model satisfies the request. It does if it is complete up to the
/// wanted eigenvalue, or if an earlier job (`record`) that wanted this eigenvalue or a higher one
/// has succeeded. A model whose band was lowered satisfies every request that leaves the band open,
/// and no other. A missing or damaged model satisfies no request. Errors: all other errors of
/// ModelStore::Summary.
absl::StatusOr<bool> IsSatisfied(ModelStore& models, const std::string& digest,
                                 const std::optional<JobRecord>& record,
                                 const v1::CreateModalModelRequest& request);

/// Does the same for any job, including the job of a transfer. A stored transfer satisfies a job
/// with its step number that wants neither more accuracy nor a higher eigenvalue.
absl::StatusOr<bool> IsSatisfied(ModeDatabase& database, const WantedJob& wanted,
                                 const std::optional<JobRecord>& record);

/// Checks that a caller may change a model: the model is not pinned, or `may_change_pinned`. A pin
/// protects a model from everybody but administrators, because others could otherwise have the
/// model deleted, by imports that exceed the budget. Errors: PermissionDenied (ROLE_MISSING).
absl::Status CheckPin(ModelStore& models, const std::string& digest, bool may_change_pinned);

/// Does the same for the model that a job computes, or to which its transfer belongs.
absl::Status CheckPin(ModelStore& models, const WantedJob& wanted);

/// Returns whether the stored model is only the coarse model that the request wants first.
bool HasCoarseModel(ModelStore& models, const std::string& digest,
                    const v1::CreateModalModelRequest& request);

/// Writes the stored form of a model to a new file. Errors: those of ModelStore::Export, and
/// ResourceExhausted (DATABASE_FULL).
absl::Status WriteModelFile(ModelStore& models, const std::string& digest,
                            const std::filesystem::path& file);

}  // namespace carillon
