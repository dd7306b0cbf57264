// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/status_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

TEST(Legible, LeavesWordsOfAnyLanguageAlone) {
  EXPECT_EQ(Legible("no preset has the name \"鐘 Größe 🔔\""),
            "no preset has the name \"鐘 Größe 🔔\"");
}

TEST(Legible, WritesControlCharactersAndInvalidBytesInHexadecimal) {
  EXPECT_EQ(Legible("a\n\x1b[31mb"), "a\\x0a\\x1b[31mb");
  EXPECT_EQ(Legible("\u202e"), "\\xe2\\x80\\xae");
  EXPECT_EQ(Legible("x\x80\xc0\xaf\xff"), "x\\x80\\xc0\\xaf\\xff");
  EXPECT_EQ(Legible("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(Legible("\xe9\x90"), "\\xe9\\x90");
}

TEST(Legible, KeepsTheBeginningAndTheEndOfALongText) {
  const std::string long_middle(5'000'000, 'x');
  const std::string text = Legible("begin" + long_middle + "end", 100);
  EXPECT_LE(text.size(), 100U);
  EXPECT_THAT(text, testing::AllOf(testing::StartsWith("begin"), testing::EndsWith("end"),
                                   testing::HasSubstr(" ... ")));
}

TEST(Legible, CutsBetweenCharacters) {
  std::string bells;
  for (int i = 0; i < 1000; ++i) bells += "鐘";
  for (size_t most = 90; most < 100; ++most) {
    const std::string text = Legible(bells, most);
    EXPECT_LE(text.size(), most);
    EXPECT_EQ(text.find('\\'), std::string::npos) << text;
  }
}

TEST(ToGrpcStatus, FitsIntoTheMetadataOfEveryClient) {
  std::string input(4'000'000, '\x1b');
  input += ": give a name";
  absl::Status refusal = Refusal(absl::StatusCode::kInvalidArgument, "INVALID_NAME", input);
  AddFigure(refusal, "name", std::string(100'000, 'n'));
  const grpc::Status status = ToGrpcStatus(refusal);
  EXPECT_THAT(status.error_message(), testing::StartsWith("INVALID_NAME: "));
  EXPECT_THAT(status.error_message(), testing::EndsWith(": give a name"));
  EXPECT_LT(status.error_message().size() + status.error_details().size(), 4096U);
}

}  // namespace
}  // namespace carillon
