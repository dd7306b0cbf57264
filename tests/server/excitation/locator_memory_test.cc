// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <vector>

#include "server/excitation/surface_locator.h"
#include "tests/server/base/little_memory.h"

namespace carillon {
namespace {

/// A strip of triangles, which is large enough that a few locators use up the memory.
struct Strip {
  static constexpr uint32_t kCount = 20'000;
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<uint32_t> given_triangle;

  Strip() {
    for (uint32_t i = 0; i < kCount + 2; ++i) {
      vertices.push_back({static_cast<float>(i), static_cast<float>(i % 2), 0});
    }
    for (uint32_t i = 0; i < kCount; ++i) {
      triangles.push_back({i, i + 1, i + 2});
      given_triangle.push_back(i);
    }
  }
};

/// Makes locators until one is refused, and prints why.
[[noreturn]] void MakeUntilRefused(rlim_t room_bytes) {
  const Strip strip;
  std::vector<std::unique_ptr<SurfaceLocator>> made;
  LeaveAddressSpace(room_bytes);
  while (true) {
    auto locator = SurfaceLocator::Make(
        {strip.vertices, strip.triangles, strip.given_triangle, strip.vertices, strip.triangles});
    if (!locator.ok()) {
      std::cerr << locator.status();
      std::_Exit(0);
    }
    made.push_back(*std::move(locator));
  }
}

TEST(LocatorMemory, ALocatorForWhichThereIsTooLittleIsRefused) {
  for (const rlim_t room_mib : {4, 64}) {
    EXPECT_EXIT(
        try { MakeUntilRefused(room_mib << 20); } catch (const std::bad_alloc&) {
          std::cerr << "SERVER_OUT_OF_MEMORY, as WithoutExceptions says";
          std::_Exit(0);
        },
        testing::ExitedWithCode(0), "SERVER_OUT_OF_MEMORY")
        << room_mib;
  }
}

}  // namespace
}  // namespace carillon
