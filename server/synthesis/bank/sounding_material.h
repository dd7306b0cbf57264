// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "proto/cpp/loss_factor.h"

namespace carillon {

/// The damping of a material, D = alpha1 K + alpha2 M and a loss factor.
struct Damping {
  double alpha1_s = 0;
  double alpha2_per_s = 0;
  std::vector<LossFactorPoint> loss_factor = {};  ///< ascending
};

/// The material of a region of a body of several materials.
struct RegionMaterial {
  std::string region;  ///< its name; an empty one stands for all regions that have no entry
  double young_pa = 0;
  double density_kg_per_m3 = 0;
  std::optional<double> poisson_ratio;
  Damping damping = {};
};

/// The material and size that turn a modal model of unit Young's modulus, density and size into a
/// sounding object.
struct SoundingMaterial {
  double young_pa = 0;
  double density_kg_per_m3 = 0;
  double alpha1_s = 0;  ///< D = alpha1 K + alpha2 M
  double alpha2_per_s = 0;
  double size = 1;                                ///< relative to the model's size
  std::vector<LossFactorPoint> loss_factor = {};  ///< ascending; damping added to D
  /// The materials of the regions of a body of several materials, whose reference the other fields
  /// describe. An object has them in the order of the model's regions.
  std::vector<RegionMaterial> regions = {};
};

}  // namespace carillon
