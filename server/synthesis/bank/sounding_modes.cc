// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sounding_modes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "server/synthesis/bank/degenerate_modes.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/bank/mode_damping.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLn1000 = 6.907755278982137;  // 60 dB as a ratio of amplitudes
constexpr double kIntegrationTimeS = 0.2;

/// The amplitude response of A-weighting (IEC 61672-1) up to a constant factor.
double AWeight(double frequency_hz) {
  const double f2 = frequency_hz * frequency_hz;
  return f2 * f2 /
         ((f2 + 20.6 * 20.6) * std::sqrt((f2 + 107.7 * 107.7) * (f2 + 737.9 * 737.9)) *
          (f2 + 12194.0 * 12194.0));
}

/// Energy of a mode's sound after a unit modal impulse, up to a constant factor.
double Audibility(const SoundingMode& mode) {
  const double amplitude =
      mode.coupling / mode.damped_rad_per_s * AWeight(mode.damped_rad_per_s / (2 * kPi));
  const double decay = -2 * mode.decay_rate_per_s;
  const double duration_s =
      decay > 0 ? -std::expm1(-decay * kIntegrationTimeS) / decay : kIntegrationTimeS;
  return amplitude * amplitude * duration_s;
}

bool Sounds(double natural_hz, double eigenvalue, double sigma, double nyquist_hz,
            const SoundingBand& band) {
  return natural_hz >= band.lowest_hz && natural_hz <= band.highest_hz && natural_hz < nyquist_hz &&
         sigma * sigma < eigenvalue && -sigma * band.shortest_t60_s <= kLn1000;
}

void KeepMostAudible(std::vector<SoundingMode>& modes, size_t most) {
  if (modes.size() <= most) return;
  std::ranges::nth_element(modes, modes.begin() + static_cast<ptrdiff_t>(most),
                           std::ranges::greater(), Audibility);
  modes.resize(most);
  std::ranges::sort(modes, {}, &SoundingMode::column);
}

/// The coupling of a mode to the air, and the damping that it causes.
struct RadiatingMode {
  double coupling = 0;     ///< as SoundingMode::coupling
  double decay_per_s = 0;  ///< by radiation
};

/// `eigenvalue` is that of mode `m` with material and size.
RadiatingMode RadiationOf(const ModeTable& table, size_t m, double eigenvalue,
                          const SoundingMaterial& material) {
  const Radiation& radiation = table.radiation;
  if (radiation.power_integrals.empty()) {
    return {.coupling = table.couplings[m] * std::sqrt(material.young_pa / material.size) /
                        material.density_kg_per_m3};
  }
  const double integral =
      double{radiation.power_integrals[m]} * material.size / material.density_kg_per_m3;
  const double displaced = radiation.air_density_kg_per_m3 * eigenvalue;
  return {.coupling = displaced * std::sqrt(integral / (4 * kPi)) / kPascalsPerVolumeVelocity,
          .decay_per_s = displaced * integral / (2 * radiation.sound_speed_m_per_s)};
}

}  // namespace

double NaturalFrequencyHz(double eigenvalue, const SoundingMaterial& material) {
  return std::sqrt(eigenvalue * material.young_pa / material.density_kg_per_m3) /
         (2 * kPi * material.size);
}

SoundingModes SelectSoundingModes(const ModeTable& table, const SoundingMaterial& material,
                                  double sample_rate_hz, const SoundingBand& band) {
  SoundingModes sounding;
  sounding.shape_scale = 1 / std::sqrt(material.density_kg_per_m3 * std::pow(material.size, 3));
  for (size_t m = 0; m < table.eigenvalues.size(); ++m) {
    const double natural_hz = NaturalFrequencyHz(table.eigenvalues[m], material);
    const double eigenvalue = std::pow(2 * kPi * natural_hz, 2);
    const RadiatingMode radiating = RadiationOf(table, m, eigenvalue, material);
    const double sigma =
        MaterialDecayRatePerS(table, m, eigenvalue, natural_hz, material) - radiating.decay_per_s;
    if (!Sounds(natural_hz, eigenvalue, sigma, sample_rate_hz / 2, band)) continue;
    sounding.modes.push_back({.column = static_cast<uint32_t>(m),
                              .natural_frequency_hz = natural_hz,
                              .damped_rad_per_s = std::sqrt(eigenvalue - sigma * sigma),
                              .decay_rate_per_s = sigma,
                              .coupling = radiating.coupling});
  }
  // Another Poisson's ratio than the model's may change the order of modes.
  std::ranges::stable_sort(sounding.modes, {}, &SoundingMode::natural_frequency_hz);
  JoinDegenerateModes(band, sounding.modes);
  std::ranges::sort(sounding.modes, {}, &SoundingMode::column);
  KeepMostAudible(sounding.modes, band.most_modes);
  return sounding;
}

}  // namespace carillon
