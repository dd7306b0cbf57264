// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/damping.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/cpp/loss_factor.h"
#include "proto/cpp/material_catalogue.h"

namespace carillon::interchange {
namespace {

constexpr size_t kMostPoints = 256;
constexpr double kSameFrequency = 1e-6;  // relative
constexpr double kUnheardPerS = 1e-3;
// The least and the greatest value that material.proto allows.
constexpr double kLeastLossFactor = 1e-9, kGreatestLossFactor = 2 - 1e-9;

double Omega(const DampedMode& mode) { return 2 * std::numbers::pi * mode.natural_hz; }

/// Damping in proportion to stiffness and mass: d = (alpha1 omega^2 + alpha2)/2.
struct Rayleigh {
  double alpha1_s = 0;
  double alpha2_per_s = 0;
};

/// Returns the damping with the least relative deviation and no negative figure: the least squares
/// of x alpha1 + y alpha2 = 1 with x = omega^2/(2 d), y = 1/(2 d).
Rayleigh FitRayleigh(const std::vector<DampedMode>& modes) {
  double xx = 0, xy = 0, yy = 0, x1 = 0, y1 = 0;
  for (const DampedMode& mode : modes) {
    if (mode.decay_per_s <= 0) continue;
    const double x = Omega(mode) * Omega(mode) / (2 * mode.decay_per_s);
    const double y = 1 / (2 * mode.decay_per_s);
    xx += x * x;
    xy += x * y;
    yy += y * y;
    x1 += x;
    y1 += y;
  }
  if (yy == 0) return {};
  const double determinant = xx * yy - xy * xy;
  // One mode, or modes of one frequency, do not determine both figures.
  if (determinant > 1e-12 * xx * yy) {
    const Rayleigh both = {.alpha1_s = (x1 * yy - y1 * xy) / determinant,
                           .alpha2_per_s = (y1 * xx - x1 * xy) / determinant};
    if (both.alpha1_s >= 0 && both.alpha2_per_s >= 0) return both;
    if (both.alpha2_per_s < 0) return {.alpha1_s = x1 / xx, .alpha2_per_s = 0};
  }
  return {.alpha1_s = 0, .alpha2_per_s = y1 / yy};
}

/// eta = 2 d/omega at the frequency of each mode, ascending; modes of one frequency share their
/// mean.
std::vector<LossFactorPoint> LossFactors(std::vector<DampedMode> modes) {
  std::ranges::sort(modes, {}, &DampedMode::natural_hz);
  std::vector<LossFactorPoint> points;
  for (size_t i = 0; i < modes.size();) {
    const double first_hz = modes[i].natural_hz;
    double sum = 0, count = 0;
    for (; i < modes.size() && modes[i].natural_hz <= first_hz * (1 + kSameFrequency); ++i) {
      sum += 2 * modes[i].decay_per_s / Omega(modes[i]);
      ++count;
    }
    points.push_back({first_hz, std::clamp(sum / count, kLeastLossFactor, kGreatestLossFactor)});
  }
  return points;
}

/// Returns as many of the points as a material may have, among them the first and the last.
std::vector<LossFactorPoint> Thinned(const std::vector<LossFactorPoint>& points) {
  if (points.size() <= kMostPoints) return points;
  std::vector<LossFactorPoint> kept;
  for (size_t i = 0; i < kMostPoints; ++i) {
    kept.push_back(points[i * (points.size() - 1) / (kMostPoints - 1)]);
  }
  return kept;
}

}  // namespace

void FitDamping(const std::vector<DampedMode>& modes, v1::Material& material) {
  // An absent figure is zero.
  material.set_alpha1_s(material.alpha1_s());
  material.set_alpha2_per_s(material.alpha2_per_s());
  if (DampingError(modes, material) <= kSameDamping) return;
  const Rayleigh nearest = FitRayleigh(modes);
  material.clear_loss_factor();
  material.set_alpha1_s(nearest.alpha1_s);
  material.set_alpha2_per_s(nearest.alpha2_per_s);
  if (DampingError(modes, material) <= kSameDamping) return;
  material.set_alpha1_s(0);
  material.set_alpha2_per_s(0);
  SetLossFactor(Thinned(LossFactors(modes)), material);
}

double DampingError(const std::vector<DampedMode>& modes, const v1::Material& material) {
  double worst = 0;
  for (const DampedMode& mode : modes) {
    const double ours = DecayRatePerS(material, mode.natural_hz);
    const double difference = std::abs(ours - mode.decay_per_s);
    if (difference > kUnheardPerS) {
      worst = std::max(worst, difference / std::max(ours, mode.decay_per_s));
    }
  }
  return worst;
}

}  // namespace carillon::interchange
