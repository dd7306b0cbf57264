// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/stored_model.h"

#include "server/decomposition/coarse_request.h"
#include "server/decomposition/decomposition_request.h"
#include "server/decomposition/job_rules.h"

namespace carillon {
namespace {

// An eigenvalue goes to the worker as a decimal number in the worker's own units and comes back, so
// its last bits may differ.
constexpr double kRelativeTolerance = 1e-9;

}  // namespace

absl::StatusOr<bool> IsSatisfied(ModelStore& models, const std::string& digest,
                                 const std::optional<JobRecord>& record,
                                 const v1::CreateModalModelRequest& request) {
  const absl::StatusOr<ModelSummary> model = models.Summary(digest);
  if (absl::IsNotFound(model.status()) || absl::IsDataLoss(model.status())) return false;
  if (!model.ok()) return model.status();
  if (IsCoarseOf(model->header, request)) return false;
  const double wanted = WantedEigenvalue(request) * (1 - kRelativeTolerance);
  if (model->header.complete_to_eigenvalue() >= wanted) return true;
  if (!record.has_value() || record->state != v1::JOB_STATE_SUCCEEDED) return false;
  const auto ran = ParseRequest(*record);
  return ran.ok() && WantedEigenvalue(*ran) >= wanted;
}

bool HasCoarseModel(ModelStore& models, const std::string& digest,
                    const v1::CreateModalModelRequest& request) {
  const absl::StatusOr<ModelSummary> model = models.Summary(digest);
  return model.ok() && IsCoarseOf(model->header, request);
}

}  // namespace carillon
