// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/rayleigh.h"

#include <algorithm>
#include <cmath>

namespace carillon::interchange {
namespace {

double DecayOf(const Rayleigh& damping, double omega2) {
  return (damping.alpha1_s * omega2 + damping.alpha2_per_s) / 2;
}

}  // namespace

Rayleigh FitRayleigh(const std::vector<DampedMode>& modes) {
  // Least squares of x a1 + y a2 = 1 with x = omega^2/(2 d), y = 1/(2 d).
  double xx = 0, xy = 0, yy = 0, x1 = 0, y1 = 0;
  for (const auto& [omega2, decay] : modes) {
    if (decay <= 0) continue;
    const double x = omega2 / (2 * decay);
    const double y = 1 / (2 * decay);
    xx += x * x;
    xy += x * y;
    yy += y * y;
    x1 += x;
    y1 += y;
  }
  if (yy == 0) return {};
  const double determinant = xx * yy - xy * xy;
  // Modes of one frequency, or one mode, tell the two apart by nothing.
  if (determinant > 1e-12 * xx * yy) {
    const Rayleigh both = {.alpha1_s = (x1 * yy - y1 * xy) / determinant,
                           .alpha2_per_s = (y1 * xx - x1 * xy) / determinant};
    if (both.alpha1_s >= 0 && both.alpha2_per_s >= 0) return both;
    if (both.alpha2_per_s < 0) return {.alpha1_s = x1 / xx, .alpha2_per_s = 0};
  }
  return {.alpha1_s = 0, .alpha2_per_s = y1 / yy};
}

double Deviation(const Rayleigh& damping, const std::vector<DampedMode>& modes) {
  double worst = 0;
  for (const auto& [omega2, decay] : modes) {
    const double ours = DecayOf(damping, omega2);
    if (ours != decay) worst = std::max(worst, std::abs(ours - decay) / std::max(ours, decay));
  }
  return worst;
}

}  // namespace carillon::interchange
