// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/damping_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace carillon::fit {
namespace {

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
