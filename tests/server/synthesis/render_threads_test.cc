// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/render_threads.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <system_error>

#include "tests/server/base/little_memory.h"

namespace carillon {
namespace {

TEST(RenderThreads, ThatTheSystemRefusesAreAnException) {
  const auto make = [] {
    LeaveAddressSpace(40 << 20);  // for a few stacks of the 64
    try {
      const RenderThreads threads(64);
    } catch (const std::system_error&) {
      std::_Exit(0);
    }
    std::_Exit(1);
  };
  EXPECT_EXIT(make(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace carillon
