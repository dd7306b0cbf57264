// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/damping.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "proto/cpp/material_catalogue.h"

namespace carillon::interchange {
namespace {

constexpr double kOmegaPerHz = 2 * std::numbers::pi;

std::vector<DampedMode> RayleighModes(double alpha1_s, double alpha2_per_s) {
  std::vector<DampedMode> modes;
  for (const double hz : {150.0, 500.0, 1500.0, 8000.0}) {
    const double omega = kOmegaPerHz * hz;
    modes.push_back({hz, (alpha1_s * omega * omega + alpha2_per_s) / 2});
  }
  return modes;
}

v1::Material Fitted(const std::vector<DampedMode>& modes, v1::Material material = {}) {
  material.set_young_pa(1);
  material.set_density_kg_per_m3(1);
  FitDamping(modes, material);
  EXPECT_TRUE(ResolveMaterial(material).ok()) << ResolveMaterial(material).status();
  return material;
}

TEST(Damping, ThatOfAMaterialIsFoundInItsDecayRates) {
  for (const auto& [alpha1_s, alpha2_per_s] :
       {std::pair{1e-7, 30.0}, std::pair{1e-7, 0.0}, std::pair{0.0, 30.0}}) {
    const v1::Material found = Fitted(RayleighModes(alpha1_s, alpha2_per_s));
    EXPECT_NEAR(found.alpha1_s(), alpha1_s, 1e-16);
    EXPECT_NEAR(found.alpha2_per_s(), alpha2_per_s, 1e-8);
    EXPECT_EQ(found.loss_factor_size(), 0);
  }
}

TEST(Damping, WhatTheMaterialHasIsKeptWhereItFits) {
  v1::Material given;
  given.set_alpha1_s(1.001e-7);
  given.set_alpha2_per_s(30);
  EXPECT_EQ(Fitted(RayleighModes(1e-7, 30), given).alpha1_s(), 1.001e-7);
  given.set_alpha1_s(1.2e-7);
  EXPECT_NEAR(Fitted(RayleighModes(1e-7, 30), given).alpha1_s(), 1e-7, 1e-16);
}

TEST(Damping, DecayRatesOfAnyKindBecomeLossFactors) {
  // Two of one frequency with their mean; one that does not decay at all.
  const std::vector<DampedMode> modes = {{3000, 7}, {200, 40}, {1000, 0}, {400, 1}, {400, 1}};
  const v1::Material found = Fitted(modes);
  EXPECT_EQ(found.loss_factor_size(), 4);
  EXPECT_EQ(DampingError(modes, found), 0);
  EXPECT_NEAR(DecayRatePerS(found, 200), 40, 1e-9);
}

TEST(Damping, ModesBeyondThePointsOfAMaterialAreFittedBetween) {
  // A loss factor that rises smoothly: what lies between two of 256 points is near their line.
  std::vector<DampedMode> modes;
  for (int i = 0; i < 2000; ++i) {
    const double hz = 50 + 9.5 * i;
    modes.push_back({hz, 1e-3 * std::pow(hz / 50, 0.3) * kOmegaPerHz * hz / 2});
  }
  const v1::Material found = Fitted(modes);
  EXPECT_EQ(found.loss_factor_size(), 256);
  EXPECT_LT(DampingError(modes, found), kSameDamping);
  EXPECT_EQ(found.loss_factor(0).frequency_hz(), 50);
  EXPECT_EQ(found.loss_factor(255).frequency_hz(), modes.back().natural_hz);
}

}  // namespace
}  // namespace carillon::interchange
