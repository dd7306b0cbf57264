// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "proto/cpp/loss_factor.h"

namespace carillon::precompute {

/// What a body is meant to be when it sounds; tells how far up to compute and what to report. None
/// of it goes into the modal model, which is for unit Young's modulus, density and size.
struct IntendedUse {
  double young_pa;
  double density_kg_per_m3;
  double alpha1_s = 0;  ///< Rayleigh damping D = alpha1 K + alpha2 M
  double alpha2_per_s = 0;
  double size = 1;     ///< relative to the mesh
  double low_hz = 20;  ///< the band of natural frequencies wanted
  double high_hz = 20000;
  std::vector<LossFactorPoint> loss_factor = {};  ///< ascending; damping added to D

  /// Lambda (unit material and size) -> Lambda E / (rho s^2), 1/s^2.
  double Eigenvalue(double unit_eigenvalue) const;
  /// The natural frequency that a unit eigenvalue has in this use.
  double FrequencyHz(double unit_eigenvalue) const;
  /// The inverse of FrequencyHz.
  double UnitEigenvalue(double frequency_hz) const;
  /// sigma = -(alpha1 Lambda + alpha2 + eta omega) / 2, 1/s, with the loss factor eta at omega.
  double DecayRatePerS(double unit_eigenvalue) const;
  /// sqrt(Lambda - sigma^2) / (2 pi); zero for an overdamped mode.
  double DampedFrequencyHz(double unit_eigenvalue) const;
};

}  // namespace carillon::precompute
