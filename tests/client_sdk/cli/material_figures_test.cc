// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/material_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carillon::cli {
namespace {

TEST(MaterialFigures, ALossFactorIsOneNumberOrATable) {
  MaterialFigures figures;
  figures.loss_factor = "0.002";
  ASSERT_EQ(ToMaterial(figures)->loss_factor_size(), 1);
  EXPECT_EQ(ToMaterial(figures)->loss_factor(0).loss_factor(), 0.002);
  figures.loss_factor = "100:0.001,1000:0.003";
  ASSERT_EQ(ToMaterial(figures)->loss_factor_size(), 2);
  EXPECT_EQ(ToMaterial(figures)->loss_factor(1).frequency_hz(), 1000);
  EXPECT_EQ(ToMaterial(figures)->loss_factor(1).loss_factor(), 0.003);
  for (const char* wrong : {"much", "100:", "0.1,0.2", "100:0.001,"}) {
    figures.loss_factor = wrong;
    EXPECT_THAT(ToMaterial(figures).status().ToString(), testing::HasSubstr("INVALID_MATERIAL: "))
        << wrong;
  }
}

TEST(MaterialFigures, FiguresNotGivenStayAbsent) {
  MaterialFigures figures;
  figures.preset = "chime_aluminum";
  figures.density_kg_per_m3 = 2800;
  const auto material = ToMaterial(figures);
  ASSERT_TRUE(material.ok()) << material.status();
  EXPECT_EQ(material->preset(), "chime_aluminum");
  EXPECT_EQ(material->density_kg_per_m3(), 2800);
  EXPECT_FALSE(material->has_young_pa());
  EXPECT_FALSE(material->has_alpha1_s());
}

}  // namespace
}  // namespace carillon::cli
