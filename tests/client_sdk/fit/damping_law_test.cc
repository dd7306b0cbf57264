// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/damping_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

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

TEST(FitDamping, FindsAConstantLossFactorInSpiteOfAGhost) {
  const auto laws = FitDamping(Decays([](double hz) { return std::numbers::pi * hz * 1e-3; }),
                               DampingKind::kAuto);
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
  const auto law = [](double hz) {
    return std::numbers::pi * hz * 1e-3 * std::pow(hz / 1000, 0.5);
  };
  for (const DampingKind kind : {DampingKind::kAuto, DampingKind::kTable}) {
    const auto laws = FitDamping(Decays(law), kind);
    ASSERT_EQ(laws[0].kind, DampingKind::kTable);
    for (const double hz : {400.0, 2000.0, 9000.0})
      EXPECT_NEAR(laws[0].DecayPerS(hz) / law(hz), 1, 0.05);
  }
}

}  // namespace
}  // namespace carillon::fit
