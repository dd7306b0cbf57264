// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/model_store.h"

namespace carillon {

/// Functions that compare the model stored under a job's digest with a resolved request.

/// Whether the stored model is complete up to the eigenvalue that the request wants, or up to where
/// an earlier job (`record`) that wanted as much could go. Errors: those of ModelStore::Summary but
/// for a model that is missing or damaged, which satisfies nobody.
absl::StatusOr<bool> IsSatisfied(ModelStore& models, const std::string& digest,
                                 const std::optional<JobRecord>& record,
                                 const v1::CreateModalModelRequest& request);

/// Whether the stored model is only the coarse one that the request wants first.
bool HasCoarseModel(ModelStore& models, const std::string& digest,
                    const v1::CreateModalModelRequest& request);

}  // namespace carillon
