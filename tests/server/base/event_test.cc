// SPDX-License-Identifier: Apache-2.0
#include "server/base/event.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace carillon {
namespace {

TEST(Event, ALineHasTheNameAndTheFieldsInTheirOrder) {
  EXPECT_EQ(Event("model_deleted").ToLine(), "model_deleted");
  EXPECT_EQ(Event("model_deleted").With("model", "modalModels/4f").With("bytes", 12).ToLine(),
            "model_deleted model=modalModels/4f bytes=12");
  EXPECT_EQ(Event("job_failed").WithSome("label", "").WithSome("client", "a").ToLine(),
            "job_failed client=a");
}

TEST(Event, AValueCanNeitherBeginALineNorForgeAFieldNorMoveACursor) {
  const auto line = [](const std::string& value) { return Event("e").With("k", value).ToLine(); };
  EXPECT_EQ(line("ipv6:%5B::1%5D:80"), "e k=ipv6:%5B::1%5D:80");
  EXPECT_EQ(line(""), "e k=\"\"");
  EXPECT_EQ(line("a b"), "e k=\"a b\"");
  EXPECT_EQ(line("x caller=root"), "e k=\"x caller=root\"");
  EXPECT_EQ(line("a=b"), "e k=\"a=b\"");
  EXPECT_EQ(line("say \"hi\""), R"(e k="say \"hi\"")");
  EXPECT_EQ(line("it's"), "e k=it's");
  EXPECT_EQ(line("it's so \\'"), R"(e k="it's so \\'")");
  EXPECT_EQ(line("back\\slash"), R"(e k="back\\slash")");
  EXPECT_EQ(line("one\ntwo\r\x1b[2J"), R"(e k="one\ntwo\r\x1b[2J")");
  EXPECT_EQ(line("gl\xc3\xbc"), R"(e k="gl\xc3\xbc")");
  EXPECT_EQ(line("\x7f"), R"(e k="\x7f")");
  EXPECT_EQ(line(std::string("\0", 1)), R"(e k="\x00")");
}

TEST(Event, AValueOfMoreThanTwoHundredBytesIsCut) {
  const std::string whole(200, 'a');
  EXPECT_EQ(Event("e").With("k", whole).fields().front().value, whole);
  EXPECT_THAT(Event("e").With("k", whole + whole).fields().front().value,
              testing::AllOf(testing::SizeIs(200), testing::EndsWith("aaa...")));
}

}  // namespace
}  // namespace carillon
