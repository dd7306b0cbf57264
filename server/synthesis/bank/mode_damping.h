// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "proto/cpp/loss_factor.h"
#include "server/synthesis/bank/sounding_material.h"

namespace carillon {

/// Returns the decay rate sigma that the damping of the material gives a mode, 1/s, not above zero
/// (docs/physics.md, 2):
///
///   sigma = -(alpha1 Lambda' + alpha2 + eta Lambda'^(1/2))/2
///
/// `eigenvalue` is Lambda', the eigenvalue with material and size, 1/s^2. eta is the loss factor at
/// `natural_hz`, which is Lambda'^(1/2)/(2 pi). SelectSoundingModes adds the damping by radiation.
inline double MaterialDecayRatePerS(double eigenvalue, double natural_hz,
                                    const SoundingMaterial& material) {
  const double eta = LossFactorAt(material.loss_factor, natural_hz);
  return -(material.alpha1_s * eigenvalue + material.alpha2_per_s + eta * std::sqrt(eigenvalue)) /
         2;
}

}  // namespace carillon
