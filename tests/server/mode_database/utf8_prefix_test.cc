// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/utf8_prefix.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

TEST(Utf8Prefix, TextThatFitsStays) {
  for (const char* text : {"", "bell", "Glöckchen", "鐘", "🔔"}) {
    EXPECT_EQ(Utf8Prefix(text, 20), text);
  }
}

TEST(Utf8Prefix, ALetterThatIsCutIsLeftOut) {
  EXPECT_EQ(Utf8Prefix("aö", 2), "a");
  EXPECT_EQ(Utf8Prefix("a鐘", 3), "a");
  EXPECT_EQ(Utf8Prefix("a鐘", 4), "a鐘");
  for (const size_t max_bytes : {1U, 2U, 3U}) EXPECT_EQ(Utf8Prefix("🔔", max_bytes), "");
  EXPECT_EQ(Utf8Prefix("ab", 1), "a");
}

TEST(Utf8Prefix, TextThatEndsWithinALetterLosesItsRemains) {
  EXPECT_EQ(Utf8Prefix("bell \xE9\x90", 200), "bell ");
  EXPECT_EQ(Utf8Prefix("\x90\x90", 200), "");
}

}  // namespace
}  // namespace carillon
