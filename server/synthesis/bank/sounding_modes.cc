// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sounding_modes.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <queue>
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

/// Two modes between which no single mode lies.
struct Neighbours {
  double split = 0;
  size_t first = 0;
  size_t second = 0;
  auto operator<=>(const Neighbours&) const = default;
};

/// The modes that have no partner yet, in ascending order of frequency, and their neighbours.
class SingleModes {
 public:
  SingleModes(const std::vector<SoundingMode>& modes, double tolerance)
      : modes_(modes),
        tolerance_(tolerance),
        before_(modes.size()),
        after_(modes.size()),
        taken_(modes.size()) {
    for (size_t i = 0; i < modes.size(); ++i) {
      // The first mode has none before it: i - 1 is then the greatest number, which is no index.
      before_[i] = i - 1;
      after_[i] = i + 1;
    }
    for (size_t i = 1; i < modes.size(); ++i) Push(i - 1, i);
  }

  /// Removes the pair of closest neighbours, and returns it. Returns nothing if no pair is left.
  std::optional<Neighbours> TakeClosest() {
    while (!candidates_.empty()) {
      const Neighbours closest = candidates_.top();
      candidates_.pop();
      if (taken_[closest.first] || taken_[closest.second]) continue;
      taken_[closest.first] = taken_[closest.second] = true;
      const size_t before = before_[closest.first];
      const size_t after = after_[closest.second];
      if (before < modes_.size()) after_[before] = after;
      if (after < modes_.size()) before_[after] = before;
      if (before < modes_.size() && after < modes_.size()) Push(before, after);
      return closest;
    }
    return std::nullopt;
  }

 private:
  void Push(size_t first, size_t second) {
    const double split = Split(modes_[first], modes_[second], tolerance_);
    if (std::isfinite(split)) candidates_.push({split, first, second});
  }

  const std::vector<SoundingMode>& modes_;
  const double tolerance_;
  std::vector<size_t> before_;
  std::vector<size_t> after_;
  std::vector<bool> taken_;
  std::priority_queue<Neighbours, std::vector<Neighbours>, std::greater<>> candidates_;
};

/// Pairs the closest neighbours first: an ovalling mode of a tube may lie between two pairs. The
/// time is O(n log n).
void PairDegenerate(std::vector<SoundingMode>& modes, const SoundingBand& band) {
  SingleModes single(modes, band.pair_tolerance);
  while (const std::optional<Neighbours> pair = single.TakeClosest()) {
    MakePair(band.directed, modes[pair->first], modes[pair->second]);
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
