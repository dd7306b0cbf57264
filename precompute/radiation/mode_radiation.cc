// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/mode_radiation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace carillon::precompute {
namespace {

/// Harmonics whose power is less than this fraction of the strongest harmonic's are not kept.
constexpr double kKeptPower = 1e-4;
/// Fraction of the power that the harmonics up to the mode's order must contain, -0.05 dB.
constexpr double kPowerInOrder = 0.98855;

}  // namespace

double ModeRadiation::efficiency() const {
  return normal_energy > 0 ? wavenumber * wavenumber * power_integral / normal_energy : 0;
}

double ModeRadiation::DecayRatePerS(const Air& air) const {
  return air.density_kg_per_m3 * air.sound_speed_m_per_s * wavenumber * wavenumber *
         power_integral / 2;
}

double PowerIntegral(std::span<const std::complex<double>> pattern, const SphereGrid& grid) {
  double integral = 0;
  for (size_t d = 0; d < pattern.size(); ++d) {
    integral += std::norm(pattern[d]) * grid.weights()[d];
  }
  return integral;
}

void ExpandPattern(std::span<const std::complex<double>> pattern, const SphereGrid& grid,
                   ModeRadiation& mode) {
  const std::vector<std::complex<double>> all = grid.Analyse(pattern);
  double whole = 0, strongest = 0;
  for (const auto& p : all) {
    whole += std::norm(p);
    strongest = std::max(strongest, std::norm(p));
  }
  double within = 0, kept = 0;
  for (mode.order = 0; mode.order <= grid.order(); ++mode.order) {
    for (int m = -mode.order; m <= mode.order; ++m) {
      within += std::norm(all[HarmonicIndex(mode.order, m)]);
    }
    if (within >= kPowerInOrder * whole) break;
  }
  std::complex<double> turn(0, mode.wavenumber);  // k i^(l + 1)
  for (int l = 0; l <= mode.order; ++l, turn *= std::complex<double>(0, 1)) {
    for (int m = -l; m <= l; ++m) {
      const size_t i = HarmonicIndex(l, m);
      if (std::norm(all[i]) < kKeptPower * strongest) continue;
      kept += std::norm(all[i]);
      mode.index.push_back(static_cast<uint32_t>(i));
      mode.value.emplace_back(turn * all[i]);
    }
  }
  const auto scale = static_cast<float>(kept > 0 ? std::sqrt(mode.power_integral / kept) : 0);
  for (std::complex<float>& value : mode.value) value *= scale;
}

std::vector<std::complex<double>> KeptPattern(const ModeRadiation& mode, const SphereGrid& grid) {
  std::vector<std::complex<double>> kept(HarmonicCount(grid.order()));
  size_t next = 0;
  std::complex<double> turn(0, mode.wavenumber);  // k i^(l + 1)
  for (int l = 0; l <= mode.order; ++l, turn *= std::complex<double>(0, 1)) {
    for (; next < mode.index.size() && mode.index[next] < HarmonicCount(l); ++next) {
      kept[mode.index[next]] = std::complex<double>(mode.value[next]) / turn;
    }
  }
  return grid.Synthesise(kept);
}

}  // namespace carillon::precompute
