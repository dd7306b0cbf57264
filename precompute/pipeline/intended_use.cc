// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/intended_use.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carillon::precompute {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

}  // namespace

double IntendedUse::Eigenvalue(double unit_eigenvalue) const {
  return unit_eigenvalue * young_pa / (density_kg_per_m3 * size * size);
}

double IntendedUse::FrequencyHz(double unit_eigenvalue) const {
  return std::sqrt(std::max(0.0, Eigenvalue(unit_eigenvalue))) / kTwoPi;
}

double IntendedUse::UnitEigenvalue(double frequency_hz) const {
  const double omega = kTwoPi * frequency_hz;
  return omega * omega / Eigenvalue(1);
}

double IntendedUse::DecayRatePerS(double unit_eigenvalue) const {
  const double natural_hz = FrequencyHz(unit_eigenvalue);
  const double loss_rate = LossFactorAt(loss_factor, natural_hz) * kTwoPi * natural_hz;
  return (alpha1_s * Eigenvalue(unit_eigenvalue) + alpha2_per_s + loss_rate) / 2;
}

double IntendedUse::DampedFrequencyHz(double unit_eigenvalue, double decay_per_s) const {
  return std::sqrt(std::max(0.0, Eigenvalue(unit_eigenvalue) - decay_per_s * decay_per_s)) / kTwoPi;
}

}  // namespace carillon::precompute
