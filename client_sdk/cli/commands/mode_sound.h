// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/client.h"
#include "client_sdk/cli/output/message_json.h"

namespace carillon::cli {

/// As the daemon has it: how far the speed of sound of a material may be from that of a transfer,
/// as a difference of logarithms.
inline constexpr double kSpeedTolerance = 0.05;

/// How a mode of a body sounds.
struct ModeSound {
  double natural_hz = 0;
  double damped_hz = 0;
  double material_decay_per_s = 0;
  std::optional<double> radiation_decay_per_s;  ///< absent if no stored transfer fits the material

  double decay_per_s() const { return material_decay_per_s + radiation_decay_per_s.value_or(0); }
  /// Seconds until the mode has decayed by 60 dB; infinite without damping.
  double T60() const;
};

/// Resolves a material for a model, see MatchRegions (region_properties.h). Errors: those of
/// ResolveMaterial and MatchRegions.
absl::StatusOr<v1::Material> MatchedMaterial(const v1::ModalModelSummary& model,
                                             const v1::Material& material);

/// Returns the member "material": the figures of a `material` of MatchedMaterial, and the name of
/// the preset from which `asked`, the material that was named for it, took them.
JsonMember MaterialMember(const v1::Material& material, const v1::Material& asked);

/// Returns whether a stored transfer fits an object of the material of MatchedMaterial.
bool HasTransfer(const v1::ModalModelSummary& model, const v1::Material& material);

/// Returns the modes of a body of a `material` of MatchedMaterial, `size` times as large as the
/// model: the natural frequency is sqrt(Lambda E/rho)/(2 pi size), and the decay by radiation is
/// rho_air omega^2 I size/(2 c rho) with the power integral I of a transfer (transfer.proto).
std::vector<ModeSound> ModesOf(const v1::ModalModelSummary& model, const v1::Material& material,
                               double size = 1);

/// Returns the frequency, Hz, up to which the model has all modes of a body of `material`.
double CompleteToHz(const v1::ModalModelSummary& model, const v1::Material& material);

/// Returns the members "frequencies_hz" (natural) and "t60_s" of the modes from `low_hz` to
/// `high_hz`. The T60 of an undamped mode is infinite, which JSON writes as null.
std::vector<JsonMember> ModeMembers(const std::vector<ModeSound>& modes, double low_hz = 0,
                                    double high_hz = std::numeric_limits<double>::infinity());

}  // namespace carillon::cli
