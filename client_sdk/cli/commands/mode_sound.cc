// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/mode_sound.h"

#include <cmath>
#include <numbers>

#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// Returns the transfer with which an object of `material` sounds, or null if none fits.
const v1::TransferSummary* FittingTransfer(const v1::ModalModelSummary& model,
                                           const v1::Material& material) {
  const double speed_m_per_s = std::sqrt(material.young_pa() / material.density_kg_per_m3());
  const v1::TransferSummary* nearest = nullptr;
  double least = kSpeedTolerance;
  for (const v1::TransferSummary& transfer : model.transfers()) {
    const v1::TransferHeader& header = transfer.header();
    const double distance =
        std::abs(std::log(speed_m_per_s / (header.speed_ratio() * header.sound_speed_m_per_s())));
    if (distance > least || transfer.power_integrals_size() != model.eigenvalues_size()) continue;
    least = distance;
    nearest = &transfer;
  }
  return nearest;
}

}  // namespace

double ModeSound::T60() const { return std::log(1000) / decay_per_s(); }

absl::StatusOr<v1::Material> MatchedMaterial(const v1::ModalModelSummary& model,
                                             const v1::Material& material) {
  ASSIGN_OR_RETURN(const v1::Material resolved, ResolveMaterial(material));
  return MatchRegions(model.header(), resolved);
}

JsonMember MaterialMember(const v1::Material& material, const v1::Material& asked) {
  v1::Material named = material;
  named.set_preset(asked.preset());
  return {"material", JsonText{MessageJson(named)}};
}

bool HasTransfer(const v1::ModalModelSummary& model, const v1::Material& material) {
  return FittingTransfer(model, material) != nullptr;
}

std::vector<ModeSound> ModesOf(const v1::ModalModelSummary& model, const v1::Material& material,
                               double size) {
  const v1::TransferSummary* const transfer = FittingTransfer(model, material);
  const double density = material.density_kg_per_m3();
  std::vector<ModeSound> modes;
  for (int i = 0; i < model.eigenvalues_size(); ++i) {
    const double omega2 = model.eigenvalues(i) * material.young_pa() / density / (size * size);
    ModeSound mode;
    mode.natural_hz = std::sqrt(omega2) / (2 * std::numbers::pi);
    mode.material_decay_per_s = DecayRatePerS(model.header(), material, i, mode.natural_hz);
    if (transfer != nullptr) {
      const v1::TransferHeader& air = transfer->header();
      mode.radiation_decay_per_s = air.air_density_kg_per_m3() * omega2 * size *
                                   transfer->power_integrals(i) /
                                   (2 * air.sound_speed_m_per_s() * density);
    }
    const double sigma = mode.decay_per_s();
    mode.damped_hz = std::sqrt(std::fmax(0, omega2 - sigma * sigma)) / (2 * std::numbers::pi);
    modes.push_back(mode);
  }
  return modes;
}

double CompleteToHz(const v1::ModalModelSummary& model, const v1::Material& material) {
  const double lambda =
      model.header().complete_to_eigenvalue() * material.young_pa() / material.density_kg_per_m3();
  return std::sqrt(lambda) / (2 * std::numbers::pi);
}

std::vector<JsonMember> ModeMembers(const std::vector<ModeSound>& modes, double low_hz,
                                    double high_hz) {
  std::vector<double> frequencies_hz, t60_s;
  for (const ModeSound& mode : modes) {
    if (mode.natural_hz < low_hz || mode.natural_hz > high_hz) continue;
    frequencies_hz.push_back(mode.natural_hz);
    t60_s.push_back(mode.T60());
  }
  return {{"frequencies_hz", std::move(frequencies_hz)}, {"t60_s", std::move(t60_s)}};
}

}  // namespace carillon::cli
