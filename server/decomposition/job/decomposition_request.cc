// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/decomposition_request.h"

#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/mesh_format.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"
#include "server/base/sha256.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/utf8_prefix.h"

namespace carillon {
namespace {

/// Upper end of a band that the request leaves open, Hz.
constexpr double kOpenBandHz = 20'000;
constexpr int kMostPriority = 100;
constexpr double kLeastTransferDb = 0.06;
constexpr double kMostTransferDb = 20;

absl::Status Invalid(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", what);
}

double HighestHz(const v1::CreateModalModelRequest& request) {
  return LeavesBandOpen(request) ? kOpenBandHz : request.max_frequency_hz();
}

absl::Status CheckMesh(const v1::CreateModalModelRequest& request) {
  if (FindMeshFormat(request.mesh_format()) == nullptr) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_FORMAT_UNKNOWN",
        absl::StrCat("mesh_format is \"", request.mesh_format(), "\"; give ", MeshFormatNames()));
  }
  if (!IsSha256Hex(request.mesh_digest())) {
    return Refusal(
        absl::StatusCode::kNotFound, "MESH_NOT_FOUND",
        "mesh_digest is not 64 lower-case hexadecimal digits: give what UploadMesh answered");
  }
  return absl::OkStatus();
}

absl::Status CheckHints(const v1::CreateModalModelRequest& request) {
  if (!(std::isfinite(request.size()) && request.size() > 0)) {
    return Invalid(absl::StrCat("size is ", request.size(), "; it must be greater than zero"));
  }
  const double high_hz = HighestHz(request);
  if (!(request.min_frequency_hz() > 0 && high_hz > request.min_frequency_hz() &&
        std::isfinite(high_hz))) {
    return Invalid(absl::StrCat("the band is ", request.min_frequency_hz(), " to ", high_hz,
                                " Hz; it must rise from above zero to a finite frequency"));
  }
  if (request.priority() < -kMostPriority || request.priority() > kMostPriority) {
    return Invalid(absl::StrCat("priority is ", request.priority(), "; it must be ", -kMostPriority,
                                " to ", kMostPriority));
  }
  if (!(std::isfinite(request.time_limit_s()) && request.time_limit_s() >= 0)) {
    return Invalid(
        absl::StrCat("time_limit_s is ", request.time_limit_s(), "; it must be zero or more"));
  }
  const v1::TransferSettings& transfer = request.transfer();
  const bool accurate =
      transfer.accuracy_db() == 0 ||
      (transfer.accuracy_db() >= kLeastTransferDb && transfer.accuracy_db() <= kMostTransferDb);
  if (!accurate || !(std::isfinite(transfer.budget_s()) && transfer.budget_s() >= 0)) {
    return Invalid(absl::StrCat("the transfer's accuracy_db is ", transfer.accuracy_db(),
                                " and its budget_s ", transfer.budget_s(), "; they must be ",
                                kLeastTransferDb, " to ", kMostTransferDb,
                                " dB and zero seconds or more"));
  }
  return absl::OkStatus();
}

/// A Poisson's ratio of exactly zero means the material's.
void FillIn(v1::DecompositionSettings& settings, const v1::Material& material) {
  const double poisson =
      settings.poisson_ratio() == 0 ? material.poisson_ratio() : settings.poisson_ratio();
  settings.set_poisson_ratio(RoundedPoissonRatio(poisson));
  SetRegions(material, settings);
  FillInDefaults(settings);
}

}  // namespace

absl::StatusOr<v1::CreateModalModelRequest> ResolveRequest(
    const v1::CreateModalModelRequest& request) {
  RETURN_IF_ERROR(CheckMesh(request));
  v1::CreateModalModelRequest resolved = request;
  resolved.set_label(Utf8Prefix(request.label(), kMaxLabelBytes));
  RETURN_IF_ERROR(ResolveUse(resolved));
  FillIn(*resolved.mutable_settings(), resolved.material());
  RETURN_IF_ERROR(CheckSettings(resolved.settings()));
  return resolved;
}

absl::Status ResolveUse(v1::CreateModalModelRequest& request) {
  ASSIGN_OR_RETURN(*request.mutable_material(), ResolveMaterial(request.material()));
  if (request.size() == 0) request.set_size(1);
  if (request.min_frequency_hz() == 0) request.set_min_frequency_hz(20);
  return CheckHints(request);
}

std::string CanonicalText(const v1::CreateModalModelRequest& resolved) {
  return absl::StrCat("carillon-decomposition 1\n",             //
                      "mesh ", resolved.mesh_digest(), "\n",    //
                      "format ", resolved.mesh_format(), "\n",  //
                      SettingsText(resolved.settings()));
}

std::string RequestDigest(const v1::CreateModalModelRequest& resolved) {
  return Sha256Hex(CanonicalText(resolved));
}

double UnitEigenvalue(const v1::CreateModalModelRequest& resolved, double frequency_hz) {
  const double omega = 2 * std::numbers::pi * frequency_hz;
  const v1::Material& material = resolved.material();
  return omega * omega * material.density_kg_per_m3() * resolved.size() * resolved.size() /
         material.young_pa();
}

bool LeavesBandOpen(const v1::CreateModalModelRequest& resolved) {
  return resolved.max_frequency_hz() == 0;
}

double WantedEigenvalue(const v1::CreateModalModelRequest& resolved) {
  return UnitEigenvalue(resolved, HighestHz(resolved));
}

}  // namespace carillon
