// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/wanted_job.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/status_macros.h"
#include "server/base/sha256.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/mode_database/transfer_store.h"

namespace carillon {
namespace {

WantedJob Name(const std::string& model, v1::CreateModalModelRequest use) {
  const std::string text =
      absl::StrCat("carillon-transfer 1\nmodel ", model, "\nspeed ", SpeedStepOf(use), "\n");
  return {.digest = Sha256Hex(text), .request = std::move(use), .transfer_of = model};
}

std::string TransferLabel(const std::string& label) {
  const std::string longer = absl::StrCat(label, " (transfer)");
  return label.empty() || longer.size() > kMaxLabelBytes ? "" : longer;
}

}  // namespace

WantedJob WantedModel(const v1::CreateModalModelRequest& resolved) {
  return {.digest = RequestDigest(resolved), .request = resolved};
}

WantedJob WantedTransfer(const std::string& model, const v1::CreateModalModelRequest& resolved) {
  v1::CreateModalModelRequest use = resolved;
  use.clear_mesh_digest();
  use.clear_mesh_format();
  use.clear_settings();
  use.clear_coarse_first();
  use.set_label(TransferLabel(resolved.label()));
  return Name(model, std::move(use));
}

WantedJob WantedTransfer(const std::string& model, const v1::TransferHeader& stored,
                         const std::string& label) {
  constexpr double kDensityKgPerM3 = 1000;  // Only the speed of sound matters.
  const double speed_m_per_s = stored.speed_ratio() * kSoundSpeedInAirMPerS;
  v1::CreateModalModelRequest use;
  use.mutable_material()->set_density_kg_per_m3(kDensityKgPerM3);
  use.mutable_material()->set_young_pa(kDensityKgPerM3 * speed_m_per_s * speed_m_per_s);
  use.mutable_material()->set_alpha1_s(0);
  use.mutable_material()->set_alpha2_per_s(0);
  use.set_size(1);
  use.set_min_frequency_hz(20);
  use.mutable_transfer()->set_accuracy_db(stored.transfer_settings().accuracy_db());
  use.set_label(TransferLabel(label));
  return Name(model, std::move(use));
}

absl::StatusOr<WantedJob> WantedTransfer(const std::string& model,
                                         const v1::CreateTransferRequest& request) {
  v1::CreateModalModelRequest use;
  *use.mutable_material() = request.material();
  use.set_size(request.size());
  use.set_min_frequency_hz(request.min_frequency_hz());
  use.set_max_frequency_hz(request.max_frequency_hz());
  *use.mutable_transfer() = request.settings();
  use.set_label(request.label());
  use.set_priority(request.priority());
  use.set_time_limit_s(request.time_limit_s());
  use.set_memory_limit_bytes(request.memory_limit_bytes());
  RETURN_IF_ERROR(ResolveUse(use));
  return Name(model, std::move(use));
}

int64_t SpeedStepOf(const v1::CreateModalModelRequest& resolved) {
  const v1::Material& material = resolved.material();
  return SpeedStep(std::sqrt(material.young_pa() / material.density_kg_per_m3()) /
                   kSoundSpeedInAirMPerS);
}

}  // namespace carillon
