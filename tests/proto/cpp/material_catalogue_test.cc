// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/material_catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

TEST(MaterialCatalogue, EveryEntryIsCompleteSourcedAndNamedOnce) {
  std::set<std::string> names;
  for (const v1::CatalogueMaterial& entry : Materials().materials()) {
    EXPECT_TRUE(ResolveMaterial(entry.material()).ok()) << entry.name();
    EXPECT_TRUE(entry.material().has_poisson_ratio()) << entry.name();
    EXPECT_FALSE(entry.source().empty()) << entry.name();
    EXPECT_TRUE(names.insert(entry.name()).second) << entry.name();
  }
  EXPECT_TRUE(names.contains("chime_aluminum"));
}

// The paper's materials keep its Rayleigh figures; all others have a loss factor and nothing else.
TEST(MaterialCatalogue, DampingIsThePapersOrTheLossFactorThatTheSourceStates) {
  for (const v1::CatalogueMaterial& entry : Materials().materials()) {
    const v1::Material& material = entry.material();
    if (entry.source().starts_with("O'Brien")) {
      EXPECT_GT(material.alpha1_s(), 0) << entry.name();
      EXPECT_EQ(material.loss_factor_size(), 0) << entry.name();
      continue;
    }
    EXPECT_EQ(material.alpha1_s() + material.alpha2_per_s(), 0) << entry.name();
    const size_t at = entry.source().find("loss factor ");
    ASSERT_NE(at, std::string::npos) << entry.name();
    ASSERT_GT(material.loss_factor_size(), 0) << entry.name();
    EXPECT_EQ(std::stod(entry.source().substr(at + 12)), material.loss_factor(0).loss_factor())
        << entry.name();
  }
}

v1::Material Preset(const std::string& name) {
  v1::Material material;
  material.set_preset(name);
  return material;
}

TEST(ResolveMaterial, ALossFactorReplacesThatOfThePreset) {
  v1::Material material = Preset("porcelain");
  SetLossFactor(std::vector<LossFactorPoint>{{500, 0.01}}, material);
  const absl::StatusOr<v1::Material> resolved = ResolveMaterial(material);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  ASSERT_EQ(resolved->loss_factor_size(), 1);
  EXPECT_EQ(resolved->loss_factor(0).loss_factor(), 0.01);
}

TEST(ResolveMaterial, RayleighDampingReplacesTheLossFactorOfThePreset) {
  v1::Material material = Preset("porcelain");
  material.set_alpha1_s(1e-7);
  const absl::StatusOr<v1::Material> resolved = ResolveMaterial(material);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_EQ(resolved->loss_factor_size(), 0);
  EXPECT_EQ(resolved->alpha1_s(), 1e-7);
}

TEST(ResolveMaterial, PutsGivenFiguresOverThePreset) {
  v1::Material material;
  material.set_preset("chime_aluminum");
  material.set_alpha2_per_s(3);
  const absl::StatusOr<v1::Material> resolved = ResolveMaterial(material);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  EXPECT_EQ(resolved->alpha2_per_s(), 3);
  EXPECT_EQ(resolved->density_kg_per_m3(), 2700);
  EXPECT_TRUE(resolved->preset().empty());
}

TEST(ResolveMaterial, RefusesALossFactorThatIsOutOfRangeOrNotAscending) {
  v1::Material material;
  material.set_preset("chime_aluminum");
  for (const std::vector<LossFactorPoint>& points : {std::vector<LossFactorPoint>{{500, -0.1}},
                                                     {{500, 2}},
                                                     {{0, 0.1}},
                                                     {{500, 0.1}, {500, 0.1}}}) {
    SetLossFactor(points, material);
    EXPECT_THAT(ResolveMaterial(material).status().ToString(), HasSubstr("INVALID_MATERIAL: "));
  }
}

TEST(LossFactor, IsStraightInTheLogarithmsAndConstantBeyondTheEnds) {
  const std::vector<LossFactorPoint> points = {{100, 0.001}, {10000, 0.1}};
  EXPECT_NEAR(LossFactorAt(points, 1000), 0.01, 1e-12);
  EXPECT_NEAR(LossFactorAt(points, 200), 0.002, 1e-12);
  EXPECT_EQ(LossFactorAt(points, 10), 0.001);
  EXPECT_EQ(LossFactorAt(points, 20000), 0.1);
  EXPECT_EQ(LossFactorAt({}, 1000), 0);
}

TEST(ResolveMaterial, RefusesFiguresOutOfRangeByName) {
  v1::Material material;
  material.set_preset("chime_aluminum");
  material.set_young_pa(-1);
  EXPECT_THAT(ResolveMaterial(material).status().ToString(), HasSubstr("young_pa is -1"));
  material.set_young_pa(7e10);
  material.set_poisson_ratio(0.5);
  EXPECT_THAT(ResolveMaterial(material).status().ToString(), HasSubstr("poisson_ratio is 0.5"));
}

}  // namespace
}  // namespace carillon
