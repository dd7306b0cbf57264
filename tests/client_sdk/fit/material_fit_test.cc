// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/material_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "client_sdk/fit/damping_law.h"
#include "tests/client_sdk/fit/struck_body.h"

namespace carillon::fit {
namespace {

using ::testing::HasSubstr;

constexpr double kYoung_pa = 70e9, kDensity = 2500, kNu = 0.24, kLossFactor = 1e-3;

/// A body of which the lowest modes were measured; its frequencies are those of another body if
/// `scrambled`, and off by up to `apart`.
FittedBody Body(size_t measured, bool scrambled = false, double apart = 0) {
  FittedBody body{.name = "body", .lines = IrregularLines(20), .modes = {}, .volume_m3 = 1e-4};
  const double speed = std::sqrt(kYoung_pa / kDensity);
  for (size_t j = 0; j < measured; ++j) {
    double hz = speed * body.lines.HertzAtUnitSpeed(j, kNu);
    if (scrambled) hz *= 1 + 0.04 * std::sin(5.0 * static_cast<double>(j * j + 1));
    hz *= 1 + apart * std::cos(3.0 * static_cast<double>(j * j));
    body.modes.push_back({.frequency_hz = hz,
                          .frequency_error_hz = 1e-4 * hz,
                          .decay_per_s = std::numbers::pi * hz * kLossFactor,
                          .decay_error_per_s = 0.1});
  }
  return body;
}

TEST(FitMaterial, FindsTheMaterialWithTheMassOfTheBody) {
  const MaterialFit fit = FitMaterial({Body(12)}, {.mass_kg = kDensity * 1e-4}).value();
  EXPECT_NEAR(fit.young_pa / kYoung_pa, 1, 0.002);
  EXPECT_NEAR(fit.poisson_ratio, kNu, 0.01);
  EXPECT_NEAR(fit.density_kg_per_m3, kDensity, 1e-6);
  EXPECT_EQ(fit.matched_count, 12U);
  ASSERT_FALSE(fit.laws.empty());
  EXPECT_NEAR(fit.laws[0].DecayPerS(2000), std::numbers::pi * 2000 * kLossFactor, 0.1);
  EXPECT_GT(fit.damping_error, 0);
  EXPECT_LT(fit.damping_error, 0.1);
  for (const FittedLine& line : fit.lines) {
    EXPECT_LT(std::abs(line.law_per_s - line.measured.decay_per_s), 2 * line.law_error_per_s);
  }
}

TEST(FitMaterial, AQuietLineDoesNotBendTheLawOfDamping) {
  FittedBody body = Body(7);
  body.modes[3].decay_per_s *= 20;
  body.modes[3].decay_error_per_s = 0.02 * body.modes[3].decay_per_s;
  body.modes[3].level_db = -65;
  const MaterialFit fit = FitMaterial({body}, {.density_kg_per_m3 = kDensity}).value();
  for (const FittedLine& line : fit.lines) {
    const double hz = line.measured.frequency_hz;
    EXPECT_NEAR(line.law_per_s / (std::numbers::pi * hz * kLossFactor), 1, 0.02) << hz;
  }
}

TEST(FitMaterial, GivesNoDampingWhereMostDecaysAreHiddenUnlessItsLawIsGiven) {
  FittedBody body = Body(9);
  for (size_t k = 3; k < body.modes.size(); ++k) {
    body.modes[k].decay_per_s *= 3;
    body.modes[k].decay_error_per_s = body.modes[k].decay_per_s;
  }
  const MaterialFit fit = FitMaterial({body}, {.density_kg_per_m3 = kDensity}).value();
  EXPECT_THAT(fit.laws, ::testing::IsEmpty());
  EXPECT_EQ(fit.decay_count, 3U);
  const MaterialFit given =
      FitMaterial({body}, {.density_kg_per_m3 = kDensity, .damping = DampingKind::kEta}).value();
  ASSERT_EQ(given.laws.size(), 1U);
  EXPECT_NEAR(given.laws[0].DecayPerS(2000), std::numbers::pi * 2000 * kLossFactor, 0.1);
}

TEST(FitMaterial, RefusesNoMassAndAMassInGramsAndADensityInGramsPerCubicCentimetre) {
  EXPECT_TRUE(FitMaterial({Body(12)}, {.mass_kg = 0.25}).ok());
  for (const FitSettings& wrong :
       {FitSettings{}, FitSettings{.mass_kg = 250}, FitSettings{.density_kg_per_m3 = 2.5}}) {
    EXPECT_THAT(FitMaterial({Body(12)}, wrong).status().ToString(), HasSubstr("INVALID_MATERIAL"));
  }
}

TEST(FitMaterial, RefusesFewLinesAndThoseOfAnotherBody) {
  const FitSettings settings{.density_kg_per_m3 = kDensity};
  EXPECT_THAT(FitMaterial({Body(4)}, settings).status().ToString(), HasSubstr("TOO_FEW_MODES"));
  EXPECT_THAT(FitMaterial({Body(12, true)}, settings).status().ToString(),
              testing::AnyOf(HasSubstr("MATCH_AMBIGUOUS"), HasSubstr("MESH_DISAGREES"),
                             HasSubstr("TOO_FEW_MODES")));
}

TEST(FitMaterial, AsksForTheMoreOddsTheMoreLinesNoModeExplains) {
  size_t refused = 0, accepted = 0;
  for (const size_t lines : {5U, 6U, 7U, 8U}) {
    for (const size_t others : {0U, 4U, 8U, 12U}) {
      FittedBody body = Body(lines);
      for (size_t k = 0; k < others; ++k) {
        MeasuredMode other = body.modes[0];
        other.frequency_hz *= std::exp(0.17 * static_cast<double>(k + 1));
        body.modes.push_back(other);
      }
      std::ranges::sort(body.modes, {}, &MeasuredMode::frequency_hz);
      const auto fit = FitMaterial({body}, {.density_kg_per_m3 = kDensity});
      ++(fit.ok() ? accepted : refused);
      if (!fit.ok()) continue;
      const auto all = static_cast<double>(lines + others);
      EXPECT_GE(fit->log_odds, 4 + 5 * (1 - static_cast<double>(fit->matched_count) / all)) << all;
      EXPECT_NEAR(fit->young_pa / kYoung_pa, 1, 0.01) << lines << " lines, " << others;
    }
  }
  EXPECT_GT(refused, 3U);
  EXPECT_GT(accepted, 5U);
}

TEST(CheckModes, TellsANoisyASilentAndAShortRecordingFromASoftBlow) {
  const std::vector<Ring> noisy = FindRings({Struck({{500, 5, 0.02}}, 0.03)});
  EXPECT_THAT(CheckModes(noisy, {}).ToString(), HasSubstr("RECORDING_TOO_NOISY"));
  const std::vector<Ring> soft = FindRings({Struck({{500, 5, 0.3}}, 1e-4)});
  EXPECT_THAT(CheckModes(soft, {}).ToString(), HasSubstr("TOO_FEW_MODES"));
  EXPECT_THAT(CheckModes({}, {}).ToString(), HasSubstr("silent"));
  const std::vector<Ring> cut = FindRings({Struck({{500, 5, 0.3}}, 1e-4, 0.1)});
  ASSERT_EQ(cut.size(), 1U);
  EXPECT_THAT(CheckModes(cut, {}).ToString(), HasSubstr("end 0.1 s after"));
}

std::vector<MeasuredDecay> Decays(const std::function<double(double)>& law,
                                  double radiation_per_hz = 0) {
  std::vector<MeasuredDecay> decays;
  for (int m = 0; m < 12; ++m) {
    const double hz = 300 * std::pow(1.4, m), radiated = radiation_per_hz * hz;
    // Deviations of 2 % that alternate.
    decays.push_back({.frequency_hz = hz,
                      .decay_per_s = (law(hz) + radiated) * (m % 2 == 0 ? 1.02 : 0.98),
                      .relative_error = 0.02,
                      .radiation_per_s = radiated});
  }
  decays[5].decay_per_s *= 3;  // a ghost's
  return decays;
}

/// The decays of a constant loss factor of 0.1 %.
double Constant(double hz) { return std::numbers::pi * hz * 1e-3; }

TEST(FitDamping, FindsAConstantLossFactorInSpiteOfAGhost) {
  const auto laws = FitDamping(Decays(Constant), DampingKind::kAuto);
  ASSERT_GE(laws.size(), 4U);
  ASSERT_EQ(laws[0].kind, DampingKind::kEta);
  EXPECT_NEAR(laws[0].loss_factor[0].loss_factor, 1e-3, 3e-5);
}

TEST(FitDamping, FindsRayleighsTwoFigures) {
  const auto law = [](double hz) {
    const double omega = 2 * std::numbers::pi * hz;
    return (2e-8 * omega * omega + 3) / 2;
  };
  const auto laws = FitDamping(Decays(law), DampingKind::kAuto);
  ASSERT_EQ(laws[0].kind, DampingKind::kRayleigh);
  EXPECT_NEAR(laws[0].alpha1_s / 2e-8, 1, 0.06);
  EXPECT_NEAR(laws[0].alpha2_per_s / 3, 1, 0.06);
}

TEST(FitDamping, LeavesToTheMaterialWhatTheBodyDoesNotRadiate) {
  const auto laws = FitDamping(Decays([](double hz) { return std::numbers::pi * hz * 4e-4; }, 4e-3),
                               DampingKind::kEta);
  ASSERT_EQ(laws.size(), 1U);
  EXPECT_NEAR(laws[0].loss_factor[0].loss_factor / 4e-4, 1, 0.15) << "radiation is four fifths";
}

TEST(FitDamping, ATableFollowsALossThatRises) {
  const auto law = [](double hz) { return Constant(hz) * std::pow(hz / 1000, 0.5); };
  for (const DampingKind kind : {DampingKind::kAuto, DampingKind::kTable}) {
    const auto laws = FitDamping(Decays(law), kind);
    ASSERT_EQ(laws[0].kind, DampingKind::kTable);
    for (const double hz : {400.0, 2000.0, 9000.0})
      EXPECT_NEAR(laws[0].DecayPerS(hz) / law(hz), 1, 0.05);
  }
}

TEST(LawErrors, HoldTheTruthInNineOfTenCases) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto rayleigh = [](double hz) { return 2e-7 * hz * hz + 1; };
  int held = 0, all = 0;
  double sum = 0;
  for (int draw = 0; draw < 40; ++draw) {
    const std::function<double(double)> law = draw % 2 == 0 ? rayleigh : std::function(Constant);
    std::vector<MeasuredDecay> decays;
    std::vector<double> frequencies_hz;
    for (int m = 0; m < 8; ++m) {
      const double hz = 400 * std::pow(1.5, m), error = m % 2 == 0 ? 0.02 : 0.1;
      frequencies_hz.push_back(hz);
      decays.push_back({.frequency_hz = hz,
                        .decay_per_s = law(hz) * std::exp(error * normal(random)),
                        .relative_error = error});
    }
    const auto laws = FitDamping(decays, DampingKind::kAuto);
    const auto errors = LawErrors(decays, laws, frequencies_hz);
    for (size_t m = 0; m < errors.size(); ++m) {
      const double hz = frequencies_hz[m];
      held += std::abs(std::log(laws[0].DecayPerS(hz) / law(hz))) < 2 * errors[m] ? 1 : 0;
      sum += errors[m];
      ++all;
    }
  }
  EXPECT_GE(held, 0.9 * all);
  EXPECT_LT(sum / all, 0.1) << "no more than the worse of the decays' errors";
}

TEST(LawErrors, GrowBeyondTheDecaysAndWithWhatIsSaidOfThem) {
  std::vector<MeasuredDecay> decays = Decays(Constant);
  const auto laws = FitDamping(decays, DampingKind::kEta);
  const auto errors = LawErrors(decays, laws, {3000, 3000 * 16});
  EXPECT_LT(errors[0], 0.05);
  EXPECT_GT(errors[1], 0.15) << "an octave and more above the last decay";
  for (MeasuredDecay& decay : decays) decay.relative_error = 0.2;
  EXPECT_GT(LawErrors(decays, laws, {3000})[0], 2 * errors[0]);
}

}  // namespace
}  // namespace carillon::fit
