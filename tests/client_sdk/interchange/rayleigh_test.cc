// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/rayleigh.h"

#include <gtest/gtest.h>

namespace carillon::interchange {
namespace {

std::vector<DampedMode> Modes(double alpha1_s, double alpha2_per_s) {
  std::vector<DampedMode> modes;
  for (const double omega : {1e3, 3e3, 1e4, 5e4}) {
    modes.push_back({omega * omega, (alpha1_s * omega * omega + alpha2_per_s) / 2});
  }
  return modes;
}

void ExpectFound(double alpha1_s, double alpha2_per_s) {
  const Rayleigh found = FitRayleigh(Modes(alpha1_s, alpha2_per_s));
  EXPECT_NEAR(found.alpha1_s, alpha1_s, 1e-9 * alpha1_s + 1e-18);
  EXPECT_NEAR(found.alpha2_per_s, alpha2_per_s, 1e-9 * alpha2_per_s + 1e-9);
  EXPECT_LT(Deviation(found, Modes(alpha1_s, alpha2_per_s)), 1e-6);
}

TEST(Rayleigh, DampingOfAMaterialIsFoundInItsDecayRates) {
  ExpectFound(1e-7, 30);
  ExpectFound(1e-7, 0);
  ExpectFound(0, 30);
  ExpectFound(0, 0);
}

TEST(Rayleigh, NeitherFigureIsEverNegative) {
  // Falling with frequency, and rising faster than its square.
  for (const auto& modes : {std::vector<DampedMode>{{1e6, 9}, {4e6, 3}, {9e6, 1}},
                            std::vector<DampedMode>{{1e6, 1}, {4e6, 16}, {9e6, 81}}}) {
    const Rayleigh found = FitRayleigh(modes);
    EXPECT_GE(found.alpha1_s, 0);
    EXPECT_GE(found.alpha2_per_s, 0);
    EXPECT_GT(found.alpha1_s + found.alpha2_per_s, 0);
    EXPECT_GT(Deviation(found, modes), 0.1);
  }
}

TEST(Rayleigh, OneModeIsFittedExactly) {
  const std::vector<DampedMode> one = {{1e8, 5}};
  EXPECT_LT(Deviation(FitRayleigh(one), one), 1e-12);
}

}  // namespace
}  // namespace carillon::interchange
