// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/exception_barrier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>
#include <stdexcept>
#include <system_error>

namespace carillon {
namespace {

using testing::HasSubstr;

template <typename Exception>
std::string StatusOf(const Exception& exception) {
  return WithoutExceptions([&]() -> absl::Status { throw exception; }).ToString();
}

TEST(ExceptionBarrier, ALackOfMemoryOrThreadsIsNoDefect) {
  EXPECT_THAT(StatusOf(std::bad_alloc()), HasSubstr("SERVER_OUT_OF_MEMORY: "));
  EXPECT_THAT(StatusOf(std::system_error(EAGAIN, std::generic_category())),
              HasSubstr("SERVER_OUT_OF_MEMORY: "));
  EXPECT_THAT(StatusOf(std::system_error(EPERM, std::generic_category())), HasSubstr("INTERNAL: "));
  EXPECT_THAT(StatusOf(std::runtime_error("x")), HasSubstr("INTERNAL: "));
}

TEST(ExceptionBarrier, AResultPassesUnchanged) {
  EXPECT_TRUE(WithoutExceptions([] { return absl::OkStatus(); }).ok());
}

}  // namespace
}  // namespace carillon
