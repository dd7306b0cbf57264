// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/body_regions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/region_properties.h"

namespace carillon::precompute {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<MeshRegion> kHammer = {{"HEAD", "STEEL"}, {"HANDLE", "WOOD"}};

absl::StatusOr<RegionMaterials> Materials(const std::vector<std::string>& texts,
                                          const std::vector<MeshRegion>& regions) {
  worker::v1::WorkerRequest request;
  AddRegions(texts, *request.mutable_material());
  if (!texts.empty()) SetRegions(*ResolveMaterial(request.material()), *request.mutable_settings());
  return MaterialsOf(request, {.regions = regions});
}

TEST(MaterialsOf, ARegionIsFoundByItsNameOrThatOfItsMaterialInTheFile) {
  const auto found = Materials({"head=structural_steel", "wood=ash"}, kHammer).value();
  ASSERT_EQ(found.materials.regions().size(), 2U);
  // The entry "head" comes first in the alphabet, and is the reference.
  EXPECT_EQ(found.materials.regions()[0].elastic.young_pa, 1);
  EXPECT_EQ(found.materials.regions()[1].region, "wood");
  EXPECT_DOUBLE_EQ(found.materials.regions()[1].elastic.young_pa, 12.0 / 210);
  EXPECT_DOUBLE_EQ(found.materials.regions()[1].density_kg_per_m3, 672.0 / 7850);
  EXPECT_EQ(found.materials.regions()[1].elastic.poisson_ratio, 0.35);
}

TEST(MaterialsOf, ANamelessEntryStandsForAllOtherRegions) {
  const auto found = Materials({"=oak", "HEAD=lead"}, kHammer).value();
  EXPECT_EQ(found.materials.regions()[1].region, "HANDLE");
  EXPECT_EQ(found.materials.regions()[1].elastic.young_pa, 1);
}

TEST(MaterialsOf, RegionsOfOneEntryAreOneRegion) {
  const auto found =
      Materials({"=oak", "WOOD=ash"}, {{"a", "wood"}, {"b", ""}, {"c", "wood"}, {"d", ""}}).value();
  ASSERT_EQ(found.materials.regions().size(), 2U);
  EXPECT_EQ(found.materials.regions()[0].region, "wood");
  EXPECT_EQ(found.materials.regions()[1].region, "");
  EXPECT_THAT(found.material_of_region, ElementsAre(0, 1, 0, 1));
}

TEST(MaterialsOf, TheMaterialsOfASurfaceMayBeItsColours) {
  EXPECT_TRUE(MaterialsOf({}, {.regions = kHammer, .triangle_regions = {0, 1}}).ok());
}

TEST(MaterialsOf, WhatDoesNotFitTheRegionsIsRefusedByName) {
  EXPECT_THAT(Materials({"head=lead"}, kHammer).status().ToString(),
              AllOf(HasSubstr("MESH_REGION_UNKNOWN: the region \"HANDLE\" (of \"WOOD\") has no"),
                    HasSubstr("\"HEAD\" (of \"STEEL\"), \"HANDLE\"")));
  EXPECT_THAT(Materials({"head=lead", "handle=oak", "hadle=ash"}, kHammer).status().ToString(),
              HasSubstr("MESH_REGION_UNKNOWN: a material is given for the region \"hadle\""));
  EXPECT_THAT(Materials({"head=lead"}, {}).status().ToString(),
              HasSubstr("the file has no regions"));
  // One material for sections of several.
  EXPECT_THAT(Materials({}, kHammer).status().ToString(),
              HasSubstr("MESH_ELEMENT_UNSUPPORTED: the file has sections of 2 materials"));
  EXPECT_TRUE(Materials({}, {{"a", ""}, {"b", ""}}).ok());
}

}  // namespace
}  // namespace carillon::precompute
