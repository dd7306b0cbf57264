// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "proto/cpp/loss_factor.h"

namespace carillon {

/// The material and size that turn a modal model of unit Young's modulus, density and size into a
/// sounding object.
struct SoundingMaterial {
  double young_pa = 0;
  double density_kg_per_m3 = 0;
  double alpha1_s = 0;  ///< D = alpha1 K + alpha2 M
  double alpha2_per_s = 0;
  double size = 1;                                ///< relative to the model's size
  std::vector<LossFactorPoint> loss_factor = {};  ///< ascending; damping added to D
};

}  // namespace carillon
