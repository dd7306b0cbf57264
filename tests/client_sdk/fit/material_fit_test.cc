// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/material_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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

}  // namespace
}  // namespace carillon::fit
