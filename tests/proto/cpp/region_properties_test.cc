// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/region_properties.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/material_catalogue.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

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
  const absl::StatusOr<v1::Material> resolved = ResolveMaterial(Hammer());
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  ASSERT_EQ(resolved->regions_size(), 2);
  EXPECT_EQ(resolved->regions(0).region(), "handle");
  EXPECT_EQ(resolved->young_pa(), 12e9);
  EXPECT_EQ(resolved->regions(1).material().young_pa(), 210e9);
  // What was resolved may be resolved again.
  EXPECT_EQ(ResolveMaterial(*resolved)->SerializeAsString(), resolved->SerializeAsString());
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
  const absl::StatusOr<v1::Material> matched = MatchRegions(header, scaled);
  ASSERT_TRUE(matched.ok()) << matched.status();
  EXPECT_DOUBLE_EQ(matched->young_pa(), 24e9);
  EXPECT_DOUBLE_EQ(matched->density_kg_per_m3(), 4 * resolved.density_kg_per_m3());
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

}  // namespace
}  // namespace carillon
