// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/decomposition/wanted_job.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/model_store.h"

namespace carillon {

/// Functions that compare what is stored with what a job is to compute.

/// Whether the stored model is complete up to the eigenvalue that the request wants, or up to where
/// an earlier job (`record`) that wanted as much could go. A model whose band was lowered satisfies
/// every request that leaves the band open. Errors: those of ModelStore::Summary but
/// for a model that is missing or damaged, which satisfies nobody.
absl::StatusOr<bool> IsSatisfied(ModelStore& models, const std::string& digest,
                                 const std::optional<JobRecord>& record,
                                 const v1::CreateModalModelRequest& request);

/// The same for any job. A stored transfer satisfies who wants one of its step of the speed ratio
/// that is no more exact and reaches no farther.
absl::StatusOr<bool> IsSatisfied(ModeDatabase& database, const WantedJob& wanted,
                                 const std::optional<JobRecord>& record);

/// Whether the stored model is only the coarse one that the request wants first.
bool HasCoarseModel(ModelStore& models, const std::string& digest,
                    const v1::CreateModalModelRequest& request);

/// Writes the stored form of a model to a new file. Errors: those of ModelStore::Export, and
/// ResourceExhausted (DATABASE_FULL).
absl::Status WriteModelFile(ModelStore& models, const std::string& digest,
                            const std::filesystem::path& file);

}  // namespace carillon
