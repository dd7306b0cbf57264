// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace carillon {

/// The directions in which the modes of a model radiate. `owner` keeps the arrays alive.
struct Directivity {
  /// #m + 1: mode i has the harmonics first[i] to first[i + 1] - 1. A mode without harmonics
  /// radiates equally in all directions.
  std::span<const uint32_t> first = {};
  std::span<const uint32_t> harmonics = {};  ///< l^2 + l + m, ascending in each mode
  /// The far pattern's coefficients (-i)^(l + 1) c_lm, scaled so that the sum of their squared
  /// magnitudes is one for each mode.
  std::span<const float> pattern_re = {}, pattern_im = {};
  std::array<double, 3> center_m{};  ///< from which directions are measured, in the body's frame
  double radius_m = 0;               ///< of the sphere about the centre that encloses the body
  std::shared_ptr<const void> owner = nullptr;
};

/// How the modes of a model radiate into air (proto/carillon/v1/transfer.proto). The caller owns
/// the arrays.
struct Radiation {
  /// #m: I, the integral of the squared far pattern over all directions, m^4/kg, for unit density
  /// and size. If it is empty, the modes sound with the paper's coupling.
  std::span<const float> power_integrals = {};
  double air_density_kg_per_m3 = 1.204;
  double sound_speed_m_per_s = 343;  ///< in air
};

/// A region's parts of the strain and kinetic energies of each mode, from 0 to 1.
struct EnergyParts {
  std::span<const float> strain;   ///< #m
  std::span<const float> kinetic;  ///< #m
};

/// The arrays of a modal model that decide how each of its modes sounds. Each array has #m numbers,
/// one for each mode.
struct ModeTable {
  std::span<const double> eigenvalues;  ///< unit material
  std::span<const double> couplings;    ///< the paper's c_m, unit material
  Radiation radiation = {};
  /// One for each of SoundingMaterial::regions; empty if the body has one material.
  std::vector<EnergyParts> regions = {};
};

}  // namespace carillon
