// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sounding_modes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

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

/// Relative difference of two neighbours' frequencies; infinite if they are not a pair.
double Split(const SoundingMode& a, const SoundingMode& b, double tolerance) {
  const auto [less, more] = std::minmax(a.coupling, b.coupling);
  const double split = b.natural_frequency_hz / a.natural_frequency_hz - 1;
  return split <= tolerance && more < 2 * less ? split : std::numeric_limits<double>::infinity();
}

void ShareMean(double SoundingMode::*figure, SoundingMode& first, SoundingMode& second) {
  first.*figure = second.*figure = (first.*figure + second.*figure) / 2;
}

void MakePair(bool directed, SoundingMode& first, SoundingMode& second) {
  ShareMean(&SoundingMode::natural_frequency_hz, first, second);
  ShareMean(&SoundingMode::damped_rad_per_s, first, second);
  ShareMean(&SoundingMode::decay_rate_per_s, first, second);
  if (directed) return;
  ShareMean(&SoundingMode::coupling, first, second);
  second.output_phase_rad = kPi / 2;
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

/// Pairs the closest neighbours first: an ovalling mode of a tube may lie between two pairs.
void PairDegenerate(std::vector<SoundingMode>& modes, const SoundingBand& band) {
  std::vector<SoundingMode*> single;
  single.reserve(modes.size());
  for (SoundingMode& mode : modes) single.push_back(&mode);
  while (single.size() > 1) {
    std::vector<double> splits;
    for (size_t i = 0; i + 1 < single.size(); ++i) {
      splits.push_back(Split(*single[i], *single[i + 1], band.pair_tolerance));
    }
    const auto closest = std::ranges::min_element(splits);
    if (std::isinf(*closest)) return;
    const auto first = single.begin() + (closest - splits.begin());
    MakePair(band.directed, **first, **(first + 1));
    single.erase(first, first + 2);
  }
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
        MaterialDecayRatePerS(eigenvalue, natural_hz, material) - radiating.decay_per_s;
    if (!Sounds(natural_hz, eigenvalue, sigma, sample_rate_hz / 2, band)) continue;
    sounding.modes.push_back({.column = static_cast<uint32_t>(m),
                              .natural_frequency_hz = natural_hz,
                              .damped_rad_per_s = std::sqrt(eigenvalue - sigma * sigma),
                              .decay_rate_per_s = sigma,
                              .coupling = radiating.coupling});
  }
  PairDegenerate(sounding.modes, band);
  KeepMostAudible(sounding.modes, band.most_modes);
  return sounding;
}

}  // namespace carillon
