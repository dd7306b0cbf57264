// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/status_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

TEST(Legible, WritesControlCharactersAndInvalidBytesInHexadecimal) {
  EXPECT_EQ(Legible("a\n\x1b[31mb"), "a\\x0a\\x1b[31mb");
  EXPECT_EQ(Legible("\u202e"), "\\xe2\\x80\\xae");
  EXPECT_EQ(Legible("x\x80\xc0\xaf\xff"), "x\\x80\\xc0\\xaf\\xff");
  EXPECT_EQ(Legible("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // a surrogate
  EXPECT_EQ(Legible("\xe9\x90"), "\\xe9\\x90");
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
