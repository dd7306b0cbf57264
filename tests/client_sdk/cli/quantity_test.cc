// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/options/quantity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "client_sdk/cli/commands/material_figures.h"

namespace carillon::cli {
namespace {

TEST(Quantity, ATimeWithAZoneIsThatMoment) {
  EXPECT_EQ(ParseTimeUnixMs("1970-01-01T00:00:01Z"), 1000);
  EXPECT_EQ(ParseTimeUnixMs("1970-01-01T02:00:00+02:00"), 0);
  for (const char* text : {"", "yesterday", "2026-13-01", "2026-11-21T25:00", "2026-11-21 x"}) {
    EXPECT_FALSE(ParseTimeUnixMs(text)) << text;
  }
}

TEST(Quantity, ADateIsTheMidnightThatBeginsItHere) {
  const auto midnight = ParseTimeUnixMs("2026-11-21");
  ASSERT_TRUE(midnight);
  EXPECT_EQ(ParseTimeUnixMs("2026-11-21T00:00"), midnight);
  EXPECT_EQ(ParseTimeUnixMs("2026-11-21T14:30:05"), *midnight + (14 * 3600 + 30 * 60 + 5) * 1000);
  // Nowhere is midnight further from that of UTC than 14 hours.
  EXPECT_LE(std::abs(*midnight - *ParseTimeUnixMs("2026-11-21T00:00:00Z")), 14 * 3600 * 1000);
}

TEST(Quantity, AGainIsAFactorOrDecibels) {
  EXPECT_EQ(ParseGain("0.5"), 0.5);
  EXPECT_EQ(ParseGain("0"), 0);
  EXPECT_EQ(ParseGain("0dB"), 1);
  EXPECT_DOUBLE_EQ(*ParseGain("-20dB"), 0.1);
  EXPECT_DOUBLE_EQ(*ParseGain("20db"), 10);
  for (const char* text : {"", "dB", "-1", "-6", "loud", "nan", "inf", "1e9", "400dB", "6 d"}) {
    EXPECT_FALSE(ParseGain(text)) << text;
  }
}

TEST(Quantity, APitchIsANoteOrHertz) {
  EXPECT_DOUBLE_EQ(*ParsePitch("A4"), 440);
  EXPECT_DOUBLE_EQ(*ParsePitch("a5"), 880);
  EXPECT_NEAR(*ParsePitch("C4"), 261.6256, 1e-4);
  EXPECT_NEAR(*ParsePitch("D5"), 587.3295, 1e-4);
  EXPECT_DOUBLE_EQ(*ParsePitch("C#3"), *ParsePitch("Db3"));
  EXPECT_DOUBLE_EQ(*ParsePitch("Cb4"), *ParsePitch("B3"));
  EXPECT_EQ(ParsePitch("587.33"), 587.33);
  for (const char* text : {"", "A", "H4", " A4", "A##4", "A4x", "-440", "0", "nan", "A99"}) {
    EXPECT_FALSE(ParsePitch(text)) << text;
  }
}

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

}  // namespace
}  // namespace carillon::cli
