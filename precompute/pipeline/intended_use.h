// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "carillon/v1/material.pb.h"
#include "proto/cpp/loss_factor.h"

namespace carillon::precompute {

/// The material and the size that a body will have when it sounds, and the band of frequencies that
/// are wanted. They determine the frequency up to which modes are computed, and the figures in the
/// report. The modal model does not depend on them, because it is for unit Young's modulus, density
/// and size.
struct IntendedUse {
  double young_pa;
  double density_kg_per_m3;
  double alpha1_s = 0;  ///< Rayleigh damping D = alpha1 K + alpha2 M
  double alpha2_per_s = 0;
  double size = 1;     ///< relative to the mesh
  double low_hz = 20;  ///< lower end of the wanted band of natural frequencies
  double high_hz = 20000;
  /// Whether `high_hz` is the default, so that it may be lowered for a body that costs too much.
  bool high_is_default = false;
  std::vector<LossFactorPoint> loss_factor = {};  ///< ascending; damping added to D
  v1::Material material = {};                     ///< the whole material, with its regions

  /// Returns Lambda E / (rho s^2), 1/s^2, for an eigenvalue Lambda of unit material and size.
  double Eigenvalue(double unit_eigenvalue) const;
  /// Returns the natural frequency of an eigenvalue of unit material and size.
  double FrequencyHz(double unit_eigenvalue) const;
  /// Returns the eigenvalue of unit material and size for a natural frequency.
  double UnitEigenvalue(double frequency_hz) const;
  /// Returns (alpha1 omega^2 + alpha2 + eta omega) / 2, 1/s, the rate of the mode's amplitude
  /// exp(-rate t), with omega^2 = Eigenvalue(unit_eigenvalue) and the loss factor eta at omega.
  double DecayRatePerS(double unit_eigenvalue) const;
  /// Returns sqrt(omega^2 - decay rate^2) / (2 pi), or zero for an overdamped mode.
  double DampedFrequencyHz(double unit_eigenvalue, double decay_per_s) const;
};

}  // namespace carillon::precompute
