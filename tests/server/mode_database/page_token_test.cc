// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/page_token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace carillon {
namespace {

using ::testing::HasSubstr;

TEST(PageToken, ATokenLeadsToTheRowsAfterItsOwn) {
  for (const int64_t last_key : {int64_t{1}, int64_t{1000}, std::numeric_limits<int64_t>::max()}) {
    const auto page = ParsePage("jobs", 7, PageToken("jobs", last_key));
    ASSERT_TRUE(page.ok()) << page.status();
    EXPECT_EQ(page->below, last_key);
    EXPECT_EQ(page->size, 7);
  }
}

TEST(PageToken, TheFirstPageNeedsNoToken) {
  const auto page = ParsePage("jobs", 0, "");
  ASSERT_TRUE(page.ok()) << page.status();
  EXPECT_EQ(page->below, std::numeric_limits<int64_t>::max());
  EXPECT_EQ(page->size, 100);
}

TEST(PageToken, TheTokenOfAnotherListAndAnyOtherTextAreRefused) {
  for (const char* token :
       {"models-5", "5", "-1", "jobs", "jobs-", "jobs--1", "jobs-0", "jobs-+5", "jobs- 5",
        "jobs-05", "jobs-5 ", "jobs-5x", "jobs-9223372036854775808", "Jobs-5"}) {
    EXPECT_THAT(
        ParsePage("jobs", 0, token).status().ToString(),
        HasSubstr("INVALID_SETTINGS: page_token is not one of an earlier answer that listed jobs"))
        << token;
  }
}

TEST(PageToken, ANegativeSizeIsRefused) {
  EXPECT_THAT(ParsePage("jobs", -1, "").status().ToString(), HasSubstr("INVALID_SETTINGS"));
}

}  // namespace
}  // namespace carillon
