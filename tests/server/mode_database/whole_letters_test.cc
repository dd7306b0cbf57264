// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/whole_letters.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

TEST(WholeLetters, TextThatFitsStays) {
  for (const char* text : {"", "bell", "Glöckchen", "鐘", "🔔"}) {
    EXPECT_EQ(WholeLetters(text, 20), text);
  }
}

TEST(WholeLetters, ALetterThatIsCutIsLeftOut) {
  EXPECT_EQ(WholeLetters("aö", 2), "a");
  EXPECT_EQ(WholeLetters("a鐘", 3), "a");
  EXPECT_EQ(WholeLetters("a鐘", 4), "a鐘");
  for (const size_t max_bytes : {1U, 2U, 3U}) EXPECT_EQ(WholeLetters("🔔", max_bytes), "");
  EXPECT_EQ(WholeLetters("ab", 1), "a");
}

TEST(WholeLetters, TextThatEndsWithinALetterLosesItsRemains) {
  EXPECT_EQ(WholeLetters("bell \xE9\x90", 200), "bell ");
  EXPECT_EQ(WholeLetters("\x90\x90", 200), "");
}

}  // namespace
}  // namespace carillon
