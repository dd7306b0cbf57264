// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/stored_model.h"

#include <algorithm>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/decomposition/job/coarse_request.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/job/job_rules.h"
#include "server/mode_database/codec/model_codec.h"

namespace carillon {
namespace {

// An eigenvalue goes to the worker as a decimal number in the worker's own units and comes back, so
// its last bits may differ.
constexpr double kRelativeTolerance = 1e-9;

// Materials of one step of the speed ratio differ by this in their eigenvalues.
constexpr double kStepTolerance = 0.03;
constexpr double kUsualAccuracyDb = 2;

bool IsAsExact(const v1::TransferHeader& stored, const v1::TransferSettings& wanted) {
  const double wanted_db = wanted.accuracy_db() > 0 ? wanted.accuracy_db() : kUsualAccuracyDb;
  const bool whole = stored.computed_mode_count() == stored.wanted_mode_count();
  return stored.transfer_settings().accuracy_db() <= wanted_db &&
         (whole || stored.transfer_settings().budget_s() >= wanted.budget_s());
}

absl::StatusOr<bool> HasTransfer(ModeDatabase& database, const WantedJob& wanted,
                                 const std::optional<JobRecord>& record) {
  ASSIGN_OR_RETURN(const auto stored, database.transfers().List(wanted.transfer_of));
  const bool exact =
      std::any_of(stored.begin(), stored.end(), [&](const TransferSummary& transfer) {
        return SpeedStep(transfer.header.speed_ratio()) == SpeedStepOf(wanted.request) &&
               IsAsExact(transfer.header, wanted.request.transfer());
      });
  if (!exact || !record.has_value()) return exact;
  const auto ran = ParseRequest(*record);
  return ran.ok() &&
         WantedEigenvalue(*ran) >= WantedEigenvalue(wanted.request) * (1 - kStepTolerance);
}

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
  // Another computation with an open band would stop as low as this one, whatever the material.
  if (model->header.lowered_from_mode_count() > 0) return LeavesBandOpen(request);
  if (!record.has_value() || record->state != v1::JOB_STATE_SUCCEEDED) return false;
  const auto ran = ParseRequest(*record);
  return ran.ok() && WantedEigenvalue(*ran) >= wanted;
}

absl::StatusOr<bool> IsSatisfied(ModeDatabase& database, const WantedJob& wanted,
                                 const std::optional<JobRecord>& record) {
  return wanted.transfer_of.empty()
             ? IsSatisfied(database.models(), wanted.digest, record, wanted.request)
             : HasTransfer(database, wanted, record);
}

absl::Status CheckPin(ModelStore& models, const std::string& digest, bool may_change_pinned) {
  if (may_change_pinned) return absl::OkStatus();
  const absl::StatusOr<ModelSummary> model = models.Summary(digest);
  if (!model.ok() || !model->pinned) return absl::OkStatus();
  return Refusal(absl::StatusCode::kPermissionDenied, "ROLE_MISSING",
                 absl::StrCat("modalModels/", digest,
                              " is pinned, and this request would change it, which needs the role "
                              "administer: use the model as it is, or ask the daemon's "
                              "administrator"));
}

absl::Status CheckPin(ModelStore& models, const WantedJob& wanted) {
  const std::string& digest = wanted.transfer_of.empty() ? wanted.digest : wanted.transfer_of;
  return CheckPin(models, digest, wanted.may_change_pinned);
}

bool HasCoarseModel(ModelStore& models, const std::string& digest,
                    const v1::CreateModalModelRequest& request) {
  const absl::StatusOr<ModelSummary> model = models.Summary(digest);
  return model.ok() && IsCoarseOf(model->header, request);
}

absl::Status WriteModelFile(ModelStore& models, const std::string& digest,
                            const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(ModelExport records, models.Export(digest));
  std::ofstream out(file, std::ios::binary);
  while (true) {
    ASSIGN_OR_RETURN(const auto record, records.Next());
    if (!record.has_value()) break;
    out << Delimited(*record);
  }
  out.close();
  if (!out.fail()) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
      absl::StrCat("the model file ", file.string(), " cannot be written: free space there"));
}

}  // namespace carillon
