// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/quantity.h"

#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/program/escaped_text.h"

namespace carillon {
namespace {

TEST(Quantity, AShareIsAPercentageOrAFraction) {
  EXPECT_EQ(ParseShare("1%"), 0.01);
  EXPECT_EQ(ParseShare("0.01"), 0.01);
  EXPECT_EQ(ParseShare("2.5%"), 0.025);
  for (const char* text :
       {"", "%", "0", "0%", "-1%", "nan", "inf", "one", "1%%", "1 %x", "1", "5", "100%"}) {
    EXPECT_FALSE(ParseShare(text)) << text;
  }
}

TEST(Quantity, ABudgetIsSecondsAndPerhapsGib) {
  EXPECT_EQ(ParseBudget("60")->seconds, 60);
  EXPECT_EQ(ParseBudget("60")->gib, 0);
  EXPECT_EQ(ParseBudget("0:1.5")->gib, 1.5);
  EXPECT_FALSE(ParseBudget("0"));
  EXPECT_FALSE(ParseBudget("0:0"));
  for (const char* text : {"", ":", "60:", ":4", "60:4:1", "-1", "60:-4", "nan", "1e999"}) {
    EXPECT_FALSE(ParseBudget(text)) << text;
  }
}

TEST(Quantity, ALengthIsANumberWithAUnitOrOfMetres) {
  EXPECT_DOUBLE_EQ(*ParseLengthM("3mm"), 0.003);
  EXPECT_EQ(ParseLengthM("0.003"), 0.003);
  EXPECT_EQ(ParseLengthM("1e-3m"), 1e-3);
  EXPECT_EQ(ParseUnitM("in"), 0.0254);
  for (const char* text : {"", "mm", "0mm", "-3mm", "3 mm", "3ell", "nan"}) {
    EXPECT_FALSE(ParseLengthM(text)) << text;
  }
}

TEST(QuotedText, BytesThatATerminalWouldObeyOrThatAreNoUtf8AreWrittenInHexadecimal) {
  EXPECT_EQ(QuotedText("T\xC3\xBCr"), "\"T\xC3\xBCr\"");
  EXPECT_EQ(QuotedText("caf\xe9\x1b[2J"), "\"caf\\xe9\\x1b[2J\"");
}

TEST(QuotedText, LongTextsAreCutBetweenCharacters) {
  EXPECT_EQ(QuotedText(std::string(100'000, 'x')),
            absl::StrCat("\"", std::string(60, 'x'), "...\""));
  // The character of two bytes would end at byte 61.
  EXPECT_EQ(QuotedText(absl::StrCat(std::string(59, 'x'), "\xC3\xBC")),
            absl::StrCat("\"", std::string(59, 'x'), "...\""));
}

}  // namespace
}  // namespace carillon
