// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sounding_modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "server/synthesis/bank/level.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
// The chime of the paper's Table 1.
const SoundingMaterial kChime{
    .young_pa = 6.835e10, .density_kg_per_m3 = 2700, .alpha1_s = 1e-7, .alpha2_per_s = 0};

/// The eigenvalue of the model that sounds at this natural frequency in this material.
double EigenvalueFor(double frequency_hz, const SoundingMaterial& material) {
  return std::pow(2 * kPi * frequency_hz * material.size, 2) * material.density_kg_per_m3 /
         material.young_pa;
}

std::vector<double> EigenvaluesFor(std::vector<double> frequencies_hz,
                                   const SoundingMaterial& material) {
  for (double& f : frequencies_hz) f = EigenvalueFor(f, material);
  return frequencies_hz;
}

SoundingModes Select(const std::vector<double>& eigenvalues, const SoundingMaterial& material,
                     const SoundingBand& band = {}, double rate_hz = 48000) {
  const std::vector<double> couplings(eigenvalues.size(), 1.0);
  return SelectSoundingModes({eigenvalues, couplings}, material, rate_hz, band);
}

/// The modes of the chime with these frequencies and couplings.
std::vector<SoundingMode> SelectOfChime(const std::vector<double>& frequencies_hz,
                                        const std::vector<double>& couplings,
                                        const SoundingBand& band = {}) {
  const std::vector<double> eigenvalues = EigenvaluesFor(frequencies_hz, kChime);
  return SelectSoundingModes({eigenvalues, couplings}, kChime, 48000, band).modes;
}

TEST(SoundingModes, FrequencyDecayAndDampedFrequencyFollowTheRayleighDamping) {
  const SoundingMaterial material{
      .young_pa = 3e9, .density_kg_per_m3 = 900, .alpha1_s = 2e-6, .alpha2_per_s = 12};
  const SoundingModes sounding = Select(EigenvaluesFor({440}, material), material);
  ASSERT_EQ(sounding.modes.size(), 1u);
  const SoundingMode& mode = sounding.modes[0];
  const double eigenvalue = std::pow(2 * kPi * 440, 2);
  EXPECT_NEAR(mode.natural_frequency_hz, 440, 1e-9);
  EXPECT_NEAR(mode.decay_rate_per_s, -(2e-6 * eigenvalue + 12) / 2, 1e-9);
  EXPECT_NEAR(
      mode.damped_rad_per_s * mode.damped_rad_per_s + mode.decay_rate_per_s * mode.decay_rate_per_s,
      eigenvalue, 1e-6 * eigenvalue);
}

TEST(SoundingModes, ALossFactorAddsHalfOfItTimesTheAngularFrequencyToTheDecay) {
  SoundingMaterial material{
      .young_pa = 3e9, .density_kg_per_m3 = 900, .alpha1_s = 2e-6, .alpha2_per_s = 12};
  const std::vector<double> eigenvalues = EigenvaluesFor({440, 3000}, material);
  const SoundingModes before = Select(eigenvalues, material);
  material.loss_factor = {{.frequency_hz = 1000, .loss_factor = 0.01}};  // at all frequencies
  const SoundingModes after = Select(eigenvalues, material);
  for (size_t m = 0; m < 2; ++m) {
    const double omega = 2 * kPi * before.modes[m].natural_frequency_hz;
    const double decay = after.modes[m].decay_rate_per_s;
    EXPECT_NEAR(decay - before.modes[m].decay_rate_per_s, -0.01 * omega / 2, 1e-9 * omega);
    EXPECT_NEAR(std::hypot(after.modes[m].damped_rad_per_s, decay), omega, 1e-9 * omega);
  }
}

/// Pitch, coupling and shape of one mode, relative to those of another material and size.
struct Scaling {
  double frequency, coupling, shape, decay;
};

Scaling Compare(const SoundingMaterial& material) {
  const std::vector<double> eigenvalues = EigenvaluesFor({1000}, kChime);
  const SoundingModes before = Select(eigenvalues, kChime), after = Select(eigenvalues, material);
  return {after.modes.at(0).natural_frequency_hz / before.modes.at(0).natural_frequency_hz,
          after.modes.at(0).coupling / before.modes.at(0).coupling,
          after.shape_scale / before.shape_scale,
          after.modes.at(0).decay_rate_per_s / before.modes.at(0).decay_rate_per_s};
}

TEST(SoundingModes, PitchCouplingShapeAndDecayScaleWithMaterialAndSize) {
  const struct {
    const char* what;
    double SoundingMaterial::*figure;
    double factor;
    Scaling right;
  } cases[] = {
      {"stiffness", &SoundingMaterial::young_pa, 4, {2, 2, 1, 4}},
      {"density", &SoundingMaterial::density_kg_per_m3, 4, {0.5, 0.25, 0.5, 0.25}},
      {"size", &SoundingMaterial::size, 4, {0.25, 0.5, 0.125, 1.0 / 16}},
      {"damping", &SoundingMaterial::alpha1_s, 3, {1, 1, 1, 3}},
  };
  for (const auto& [what, figure, factor, right] : cases) {
    SoundingMaterial material = kChime;
    material.*figure *= factor;
    const Scaling scaling = Compare(material);
    EXPECT_NEAR(scaling.frequency, right.frequency, 1e-12) << what;
    EXPECT_NEAR(scaling.coupling, right.coupling, 1e-12) << what;
    EXPECT_NEAR(scaling.shape, right.shape, 1e-12) << what;
    EXPECT_NEAR(scaling.decay, right.decay, 1e-12) << what;
  }
}

TEST(SoundingModes, ModesOutsideTheBandAreDropped) {
  const auto eigenvalues = EigenvaluesFor({19, 21, 10000, 19999, 20001}, kChime);
  const SoundingModes sounding = Select(eigenvalues, kChime);
  ASSERT_EQ(sounding.modes.size(), 3u);
  EXPECT_EQ(sounding.modes.front().column, 1u);
  EXPECT_EQ(sounding.modes.back().column, 3u);
  EXPECT_EQ(Select(eigenvalues, kChime, {.lowest_hz = 18}).modes.size(), 4u);
  // Half of the sample rate bounds the band, too.
  EXPECT_EQ(Select(EigenvaluesFor({10000, 11026}, kChime), kChime, {}, 22050).modes.size(), 1u);
}

TEST(SoundingModes, OverdampedModesAreDroppedThoughTheirFrequencyIsInTheBand) {
  // alpha1 = 8e-6 s makes sigma^2 = Lambda at 39.8 kHz; a T60 of 2 ms ends at 4.7 kHz.
  SoundingMaterial wood{
      .young_pa = 2.8e8, .density_kg_per_m3 = 550, .alpha1_s = 8e-6, .alpha2_per_s = 50};
  const auto eigenvalues = EigenvaluesFor({4600, 4700, 39000, 40000}, wood);
  EXPECT_EQ(Select(eigenvalues, wood).modes.size(), 1u);
  const SoundingBand all{.highest_hz = 1e6, .shortest_t60_s = 0};
  EXPECT_EQ(Select(eigenvalues, wood, all, 192000).modes.size(), 3u);
}

TEST(SoundingModes, OfTooManyTheMostAudibleAreKeptInTheOrderOfTheModel) {
  const auto modes =
      SelectOfChime({100, 200, 400, 800, 1600, 3200}, {1, 1e6, 2, 1e6, 1e6, 3}, {.most_modes = 3});
  ASSERT_EQ(modes.size(), 3u);
  EXPECT_EQ(modes[0].column, 1u);
  EXPECT_EQ(modes[1].column, 3u);
  EXPECT_EQ(modes[2].column, 4u);
}

TEST(SoundingModes, TheTwoOfADegeneratePairShareAllButAQuarterPeriod) {
  const auto modes = SelectOfChime({587.0, 587.5, 1500}, {3, 4, 5});
  ASSERT_EQ(modes.size(), 3u);
  EXPECT_EQ(modes[0].coupling, modes[1].coupling);
  EXPECT_EQ(modes[0].damped_rad_per_s, modes[1].damped_rad_per_s);
  EXPECT_EQ(modes[0].decay_rate_per_s, modes[1].decay_rate_per_s);
  EXPECT_NEAR(modes[0].natural_frequency_hz, 587.25, 1e-9);
  EXPECT_EQ(modes[0].output_phase_rad, 0);
  EXPECT_NEAR(modes[1].output_phase_rad, kPi / 2, 1e-15);
  EXPECT_EQ(modes[2].output_phase_rad, 0);
}

TEST(SoundingModes, ThreeOrMoreNeighboursApartFromOthersAreAMultiplet) {
  // Three modes that a mesh split, a pair, seven in two groups, and five in a row.
  const std::vector<double> hz{1000,   1000.1, 1000.3, 2000, 2000.2, 3000, 3000.1, 3000.2, 3003.1,
                               3003.2, 3003.3, 3003.4, 5000, 5001,   5002, 5007,   5012};
  std::vector<double> couplings(hz.size(), 1);
  couplings[1] = 1.5;
  const auto modes = SelectOfChime(hz, couplings);
  std::vector<uint32_t> multiplets;
  multiplets.reserve(modes.size());
  for (const SoundingMode& mode : modes) multiplets.push_back(mode.multiplet);
  EXPECT_EQ(multiplets, (std::vector<uint32_t>{1, 1, 1, 0, 0, 2, 2, 2, 2, 2, 2, 2, 0, 0, 0, 0, 0}));
  const double unit = Select(EigenvaluesFor({440}, kChime), kChime).modes[0].coupling;
  for (size_t m = 0; m < 3; ++m) {
    EXPECT_NEAR(modes[m].natural_frequency_hz, (1000 + 1000.1 + 1000.3) / 3, 1e-9);
    EXPECT_NEAR(modes[m].coupling, unit * std::sqrt((1 + 1.5 * 1.5 + 1) / 3), 1e-9 * unit);
    EXPECT_EQ(modes[m].decay_rate_per_s, modes[0].decay_rate_per_s);
  }
  EXPECT_NEAR(modes[4].output_phase_rad, kPi / 2, 1e-15);
  const auto directed = SelectOfChime(hz, couplings, {.directed = true});
  EXPECT_EQ(directed[2].natural_frequency_hz, modes[2].natural_frequency_hz);
  EXPECT_NEAR(directed[1].coupling, 1.5 * unit, 1e-9 * unit);
  EXPECT_EQ(directed[1].multiplet, 0U);
}

TEST(SoundingModes, ModesOfOneFrequencyAndDifferentCouplingsAreNoMultipletOrPair) {
  // The twisting modes of a ball hardly move the air.
  for (const SoundingMode& mode : SelectOfChime({1000, 1000.1, 1000.2}, {1, 1, 2})) {
    EXPECT_EQ(mode.multiplet, 0U);
  }
  // A torsional mode that happens to lie beside a bending one.
  const auto modes = SelectOfChime({587.0, 587.1}, {3, 0.01});
  EXPECT_NEAR(modes[0].natural_frequency_hz, 587.0, 1e-9);
  EXPECT_EQ(modes[1].output_phase_rad, 0);
}

/// Returns the partner of each mode, or the mode itself, by the definition: the closest two of the
/// modes without a partner become a pair, again and again. The time is quadratic.
std::vector<size_t> PartnersByDefinition(const std::vector<double>& ascending_hz) {
  std::vector<size_t> partners(ascending_hz.size());
  std::iota(partners.begin(), partners.end(), 0);
  std::vector<size_t> single = partners;
  const double tolerance = SoundingBand().pair_tolerance;
  while (single.size() > 1) {
    const auto split = [&](size_t i) {
      return ascending_hz[single[i + 1]] / ascending_hz[single[i]] - 1;
    };
    size_t closest = 0;
    for (size_t i = 1; i + 1 < single.size(); ++i) {
      closest = split(i) < split(closest) ? i : closest;
    }
    if (split(closest) > tolerance) break;
    partners[single[closest]] = single[closest + 1];
    partners[single[closest + 1]] = single[closest];
    single.erase(single.begin() + static_cast<ptrdiff_t>(closest),
                 single.begin() + static_cast<ptrdiff_t>(closest) + 2);
  }
  return partners;
}

TEST(SoundingModes, ThePairsOfAThousandDenseModesAreThoseOfTheDefinition) {
  std::mt19937 random(20261125);
  std::uniform_real_distribution<double> ratio(1.0006, 1.004);  // no multiplets
  std::vector<double> frequencies_hz{100};
  while (frequencies_hz.size() < 1000 && frequencies_hz.back() < 9000) {
    frequencies_hz.push_back(frequencies_hz.back() * ratio(random));
  }
  const std::vector<size_t> partners = PartnersByDefinition(frequencies_hz);
  const auto modes = SelectOfChime(frequencies_hz, std::vector(frequencies_hz.size(), 1.0),
                                   {.most_modes = frequencies_hz.size()});
  ASSERT_EQ(modes.size(), frequencies_hz.size());
  for (size_t i = 0; i < modes.size(); ++i) {
    const double mean_hz = (frequencies_hz[i] + frequencies_hz[partners[i]]) / 2;
    EXPECT_NEAR(modes[i].natural_frequency_hz, mean_hz, 1e-9 * mean_hz) << i;
  }
}

/// Radiation of modes with these power integrals, into the air of the defaults.
SoundingModes SelectRadiating(const std::vector<double>& eigenvalues,
                              const std::vector<float>& integrals,
                              const SoundingMaterial& material) {
  const std::vector<double> couplings(eigenvalues.size(), 1.0);
  return SelectSoundingModes({eigenvalues, couplings, {.power_integrals = integrals}}, material,
                             48000);
}

TEST(SoundingModes, AModeLosesThePowerThatItsSoundCarriesAway) {
  const Radiation air;
  const std::vector<double> eigenvalues = EigenvaluesFor({440, 3000}, kChime);
  const SoundingModes still = Select(eigenvalues, kChime);
  const SoundingModes radiating = SelectRadiating(eigenvalues, {3.0F, 0.2F}, kChime);
  for (size_t m = 0; m < 2; ++m) {
    const SoundingMode& mode = radiating.modes.at(m);
    // With modal velocity 1 the mode has the energy 1/2 and the displacement 1/omega.
    const double omega = 2 * kPi * mode.natural_frequency_hz;
    const double pressure_pa = kPascalsPerVolumeVelocity * mode.coupling / omega;  // at 1 m
    const double intensity =
        pressure_pa * pressure_pa / (2 * air.air_density_kg_per_m3 * air.sound_speed_m_per_s);
    const double loss_per_s = still.modes.at(m).decay_rate_per_s - mode.decay_rate_per_s;
    EXPECT_NEAR(loss_per_s, 4 * kPi * intensity, 1e-9 * loss_per_s);
    EXPECT_GT(loss_per_s, 0);
  }
}

TEST(SoundingModes, RadiationScalesWithDensityAndSizeAtOneSpeedRatio) {
  const std::vector<double> eigenvalues = EigenvaluesFor({1000}, kChime);
  SoundingMaterial lossless = kChime;
  lossless.alpha1_s = 0;
  SoundingMaterial other = lossless;
  other.young_pa *= 3;
  other.density_kg_per_m3 *= 3;
  other.size = 2;
  const SoundingMode before = SelectRadiating(eigenvalues, {1.0F}, lossless).modes.at(0);
  const SoundingMode after = SelectRadiating(eigenvalues, {1.0F}, other).modes.at(0);
  EXPECT_NEAR(after.decay_rate_per_s / before.decay_rate_per_s, 1 / (3 * 2.0), 1e-12);
  // rho0 omega^2 (I g / rho)^(1/2), with omega halved.
  EXPECT_NEAR(after.coupling / before.coupling, 0.25 * std::sqrt(2 / 3.0), 1e-12);
}

TEST(SoundingModes, AModeThatRadiatesAwayWithinTwoMillisecondsDoesNotSound) {
  const std::vector<double> eigenvalues = EigenvaluesFor({1000, 2000}, kChime);
  const double weight = 1.204 * std::pow(2 * kPi * 2000, 2) / (2 * 343) / kChime.density_kg_per_m3;
  const auto lost_in_2_ms = static_cast<float>(std::log(1000) / 0.002 / weight);
  EXPECT_EQ(SelectRadiating(eigenvalues, {0, 0.9F * lost_in_2_ms}, kChime).modes.size(), 2u);
  EXPECT_EQ(SelectRadiating(eigenvalues, {0, 1.1F * lost_in_2_ms}, kChime).modes.size(), 1u);
}

TEST(SoundingModes, AnEigenvalueThatIsNotANumberDoesNotSound) {
  EXPECT_TRUE(Select({std::nan("")}, kChime).modes.empty());
}

}  // namespace
}  // namespace carillon
