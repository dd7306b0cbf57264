// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/escaped_text.h"

#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

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
