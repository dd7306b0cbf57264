// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/worker_request.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "precompute/pipeline/fixture_codec.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"
#include "proto/cpp/worker_request_text.h"

namespace carillon::precompute {
namespace {

constexpr double kBytesPerGib = 1024.0 * 1024 * 1024;
constexpr double kUsualAccuracyDb = 2;
constexpr double kHighestHz = 20'000;  // where the request names none
// No body that can be meshed has a mode as high as this.
constexpr double kMostHz = 1e9;

absl::Status Invalid(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", what);
}

absl::Status CheckTransfer(const v1::TransferSettings& transfer) {
  const double accuracy_db = transfer.accuracy_db();
  if (accuracy_db != 0 && !(accuracy_db >= 0.06 && accuracy_db <= 20)) {
    return Invalid(absl::StrCat("the accuracy of the radiation is ", accuracy_db,
                                " dB; it must be from 0.06 to 20 dB"));
  }
  if (transfer.budget_s() >= 0 && std::isfinite(transfer.budget_s())) return absl::OkStatus();
  return Invalid(absl::StrCat("the processor time for the radiation is ", transfer.budget_s(),
                              " s; it must be finite and not below zero"));
}

/// Upper end of the band, whether somebody asked for it or not.
double HighestHz(const worker::v1::WorkerRequest& request) {
  return request.max_frequency_hz() == 0 ? kHighestHz : request.max_frequency_hz();
}

absl::Status CheckUse(const worker::v1::WorkerRequest& request) {
  if (!(request.size() > 0) || !std::isfinite(request.size())) {
    return Invalid(absl::StrCat("size is ", request.size(), "; it must be above zero"));
  }
  const double high_hz = HighestHz(request);
  if (!(request.min_frequency_hz() >= 0 && request.min_frequency_hz() < high_hz &&
        high_hz <= kMostHz)) {
    return Invalid(absl::StrCat("the band is ", request.min_frequency_hz(), " to ", high_hz,
                                " Hz; it must rise from zero or more to at most 1e9 Hz"));
  }
  RETURN_IF_ERROR(CheckTransfer(request.transfer()));
  if (request.material().has_young_pa() && request.material().has_density_kg_per_m3()) {
    return absl::OkStatus();
  }
  return Invalid("the material has no Young's modulus or no density; give both");
}

}  // namespace

absl::StatusOr<worker::v1::WorkerRequest> Complete(worker::v1::WorkerRequest request) {
  FillInDefaults(*request.mutable_settings());
  if (request.size() == 0) request.set_size(1);
  if (!request.radiate_stored_model()) RETURN_IF_ERROR(CheckSettings(request.settings()));
  RETURN_IF_ERROR(CheckUse(request));
  const bool radiate = request.has_transfer() || request.radiate_stored_model();
  if (radiate && request.transfer().accuracy_db() == 0) {
    request.mutable_transfer()->set_accuracy_db(kUsualAccuracyDb);
  }
  ASSIGN_OR_RETURN(*request.mutable_material(), ResolveMaterial(request.material()));
  SetRegions(request.material(), *request.mutable_settings());
  return request;
}

absl::StatusOr<worker::v1::WorkerRequest> ReadWorkerRequest(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad()) {
    return Invalid(
        absl::StrCat("the request ", path, " cannot be read; check its name and its permissions"));
  }
  ASSIGN_OR_RETURN(worker::v1::WorkerRequest request, ParseWorkerRequest(text));
  return Complete(std::move(request));
}

IntendedUse UseOf(const worker::v1::WorkerRequest& request) {
  const v1::Material& material = request.material();
  return {.young_pa = material.young_pa(),
          .density_kg_per_m3 = material.density_kg_per_m3(),
          .alpha1_s = material.alpha1_s(),
          .alpha2_per_s = material.alpha2_per_s(),
          .size = request.size(),
          .low_hz = request.min_frequency_hz(),
          .high_hz = HighestHz(request),
          .high_is_default = request.max_frequency_hz() == 0,
          .loss_factor = LossFactorOf(material),
          .material = material};
}

MeshingSettings MeshingOf(const worker::v1::WorkerRequest& request) {
  const v1::MeshSettings& mesh = request.settings().mesh();
  MeshingSettings meshing{
      .target_node_count = static_cast<int>(mesh.target_node_count()),
      .nodes_per_element = request.settings().element() == v1::ELEMENT_LINEAR ? 4 : 10,
      .cautious = request.cautious()};
  if (mesh.has_keep_surface()) meshing.keep_surface = mesh.keep_surface();
  return meshing;
}

ResolutionGoal GoalOf(const worker::v1::WorkerRequest& request) {
  const v1::MeshSettings& mesh = request.settings().mesh();
  return {.accuracy = mesh.accuracy(),
          .budget_s = mesh.budget_s(),
          .budget_bytes = mesh.budget_gib() * kBytesPerGib};
}

MassSharing MassSharingOf(const worker::v1::WorkerRequest& request) {
  return request.settings().mass_matrix() == v1::MASS_MATRIX_LUMPED ? MassSharing::kLumped
                                                                    : MassSharing::kConsistent;
}

std::vector<Fixture> FixturesOf(const worker::v1::WorkerRequest& request) {
  std::vector<Fixture> fixtures;
  for (const v1::Fixture& fixture : request.settings().fixtures()) {
    fixtures.push_back(FromProto(fixture));
  }
  return fixtures;
}

}  // namespace carillon::precompute
