// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/material_catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/poisson_change.h"
#include "proto/cpp/region_properties.h"

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

v1::Material Resolved(const v1::Material& material) {
  const absl::StatusOr<v1::Material> resolved = ResolveMaterial(material);
  EXPECT_TRUE(resolved.ok()) << resolved.status();
  return resolved.value_or(v1::Material());
}

TEST(ResolveMaterial, PutsGivenFiguresAndDampingOverThoseOfThePreset) {
  v1::Material material = Preset("porcelain");
  SetLossFactor(std::vector<LossFactorPoint>{{500, 0.01}}, material);
  ASSERT_EQ(Resolved(material).loss_factor_size(), 1);
  EXPECT_EQ(Resolved(material).loss_factor(0).loss_factor(), 0.01);
  material = Preset("porcelain");
  material.set_alpha1_s(1e-7);
  EXPECT_EQ(Resolved(material).loss_factor_size(), 0);
  EXPECT_EQ(Resolved(material).alpha1_s(), 1e-7);
  material = Preset("chime_aluminum");
  material.set_alpha2_per_s(3);
  EXPECT_EQ(Resolved(material).alpha2_per_s(), 3);
  EXPECT_EQ(Resolved(material).density_kg_per_m3(), 2700);
  EXPECT_TRUE(Resolved(material).preset().empty());
}

TEST(ResolveMaterial, RefusesALossFactorThatIsOutOfRangeOrNotAscending) {
  v1::Material material = Preset("chime_aluminum");
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
  v1::Material material = Preset("chime_aluminum");
  material.set_young_pa(-1);
  EXPECT_THAT(ResolveMaterial(material).status().ToString(), HasSubstr("young_pa is -1"));
  material.set_young_pa(7e10);
  material.set_poisson_ratio(0.5);
  EXPECT_THAT(ResolveMaterial(material).status().ToString(), HasSubstr("poisson_ratio is 0.5"));
}

v1::Material Hammer() {
  v1::Material material;
  AddRegions({"Head=structural_steel", "HANDLE=ash"}, material);
  return material;
}

/// The header of a model of the hammer with one mode, of which the handle has a part of the
/// energies.
v1::ModalModelHeader HeaderOf(const v1::Material& resolved, float strain, float kinetic) {
  v1::DecompositionSettings settings;
  SetRegions(resolved, settings);
  v1::ModalModelHeader header;
  for (const v1::RegionProperties& properties : settings.regions()) {
    v1::ModalModelRegion& region = *header.add_regions();
    *region.mutable_properties() = properties;
    const bool is_handle = properties.region() == "handle";
    region.add_strain_energy_parts(is_handle ? strain : 1 - strain);
    region.add_kinetic_energy_parts(is_handle ? kinetic : 1 - kinetic);
  }
  return header;
}

TEST(ResolveMaterial, RegionsHaveAnOrderAndTheFirstIsTheReference) {
  const v1::Material resolved = *ResolveMaterial(Hammer());
  ASSERT_EQ(resolved.regions_size(), 2);
  EXPECT_EQ(resolved.regions(0).region(), "handle");
  EXPECT_EQ(resolved.young_pa(), 12e9);
  EXPECT_EQ(resolved.regions(1).material().young_pa(), 210e9);
  // A resolved material may be resolved again.
  EXPECT_EQ(ResolveMaterial(resolved)->SerializeAsString(), resolved.SerializeAsString());
}

TEST(ResolveMaterial, ARegionHasOneMaterialAndAPresetBesideRegionsIsRefused) {
  v1::Material twice = Hammer();
  AddRegions({"hEAD=lead"}, twice);
  EXPECT_THAT(ResolveMaterial(twice).status().ToString(),
              HasSubstr("INVALID_MATERIAL: the region \"hEAD\" has two materials"));
  v1::Material beside = Hammer();
  beside.set_preset("oak");
  EXPECT_THAT(ResolveMaterial(beside).status().ToString(), HasSubstr("INVALID_MATERIAL: "));
}

TEST(AddRegions, FiguresWithoutARegionAreThoseOfAllOthers) {
  v1::Material material;
  material.set_preset("oak");
  AddRegions({"a=b=lead"}, material);
  ASSERT_EQ(material.regions_size(), 2);
  EXPECT_EQ(FindRegion(material, "A=B")->preset(), "lead");
  EXPECT_EQ(FindRegion(material, "anything")->preset(), "oak");
  EXPECT_EQ(FindRegion(Hammer(), "anything"), nullptr);
}

// Twice as stiff, four times as dense: the model's eigenvalues serve, divided by two.
TEST(MatchRegions, CommonFactorsChangeTheReferenceAlone) {
  const v1::Material resolved = *ResolveMaterial(Hammer());
  const v1::ModalModelHeader header = HeaderOf(resolved, 0.5, 0.5);
  v1::Material scaled = resolved;
  for (v1::RegionMaterial& region : *scaled.mutable_regions()) {
    region.mutable_material()->set_young_pa(2 * region.material().young_pa());
    region.mutable_material()->set_density_kg_per_m3(4 * region.material().density_kg_per_m3());
  }
  const v1::Material matched = *MatchRegions(header, scaled);
  EXPECT_DOUBLE_EQ(matched.young_pa(), 24e9);
  EXPECT_DOUBLE_EQ(matched.density_kg_per_m3(), 4 * resolved.density_kg_per_m3());
}

TEST(MatchRegions, RefusesARegionWithoutAMaterialAndRegionsOfAModelWithoutAny) {
  const v1::Material resolved = *ResolveMaterial(Hammer());
  v1::Material oak;
  oak.set_preset("oak");
  for (const auto& refused : {MatchRegions(HeaderOf(resolved, 0.5, 0.5), *ResolveMaterial(oak)),
                              MatchRegions({}, resolved)}) {
    EXPECT_THAT(refused.status().ToString(), HasSubstr("REGION_MATERIAL_DIFFERS: "));
  }
}

TEST(DecayRatePerS, IsTheMeanByStrainEnergyAndMassDampingByKineticEnergy) {
  v1::Material material = *ResolveMaterial(Hammer());
  material.mutable_regions(0)->mutable_material()->set_alpha2_per_s(8);
  const v1::ModalModelHeader header = HeaderOf(material, 0.75, 0.25);
  const double omega = 2 * std::numbers::pi * 500;
  const double eta = 0.75 * 0.01 + 0.25 * 2.5e-5;
  EXPECT_NEAR(DecayRatePerS(header, material, 0, 500), (eta * omega + 0.25 * 8) / 2, 1e-9);
}

TEST(EigenvalueChange, IsExactForTorsionAndForTheBendingOfAPlate) {
  for (const double from : {0.2, 0.33}) {
    for (const double to : {0.1, 0.28, 0.4}) {
      EXPECT_NEAR(EigenvalueChange(-1 / (1 + from), from, to), (1 + from) / (1 + to), 1e-12);
      EXPECT_NEAR(EigenvalueChange(2 * from / (1 - from * from), from, to),
                  (1 - from * from) / (1 - to * to), 1e-12);
      EXPECT_DOUBLE_EQ(EigenvalueChange(0, from, to), 1);
    }
  }
}

TEST(EigenvalueChange, HasTheSlopeThatItIsGiven) {
  constexpr double kStep = 1e-5;
  for (const double from : {0.0, 0.02, 0.18, 0.28, 0.45}) {
    for (const double slope : {-1.2, -0.7, -0.1, 0.3, 0.9, 2.5}) {
      const double change =
          EigenvalueChange(slope, from, from + kStep) - EigenvalueChange(slope, from, from - kStep);
      EXPECT_NEAR(change / (2 * kStep), slope, 1e-4) << from;
    }
  }
}

}  // namespace
}  // namespace carillon
