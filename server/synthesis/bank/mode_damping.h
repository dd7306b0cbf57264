// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "proto/cpp/loss_factor.h"
#include "server/synthesis/bank/radiation.h"
#include "server/synthesis/bank/sounding_material.h"

namespace carillon {

/// Returns the decay rate sigma that the damping of the material gives mode `m` of a body, 1/s, not
/// above zero (docs/physics.md, 2):
///
///   sigma = -(alpha1 Lambda' + alpha2 + eta Lambda'^(1/2))/2
///
/// `eigenvalue` is Lambda', the eigenvalue with material and size, 1/s^2. eta is the loss factor at
/// `natural_hz`, which is Lambda'^(1/2)/(2 pi). In a body of several materials alpha1 and eta are
/// the means over the regions weighted by their strain energy, and alpha2 that by their kinetic
/// energy. SelectSoundingModes adds the damping by radiation.
inline double MaterialDecayRatePerS(const ModeTable& table, size_t m, double eigenvalue,
                                    double natural_hz, const SoundingMaterial& material) {
  const double omega = std::sqrt(eigenvalue);
  if (table.regions.empty()) {
    const double eta = LossFactorAt(material.loss_factor, natural_hz);
    return -(material.alpha1_s * eigenvalue + material.alpha2_per_s + eta * omega) / 2;
  }
  double rate = 0;
  for (size_t r = 0; r < table.regions.size(); ++r) {
    const Damping& damping = material.regions[r].damping;
    const double eta = LossFactorAt(damping.loss_factor, natural_hz);
    rate -= double{table.regions[r].strain[m]} * (damping.alpha1_s * eigenvalue + eta * omega) / 2 +
            double{table.regions[r].kinetic[m]} * damping.alpha2_per_s / 2;
  }
  return rate;
}

}  // namespace carillon
