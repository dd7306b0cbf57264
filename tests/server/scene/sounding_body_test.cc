// SPDX-License-Identifier: Apache-2.0
#include "server/scene/sounding_body.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <memory>

#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

TEST(BodyCache, ReturnsTheSameBodyWhileAnObjectUsesIt) {
  BodyCache bodies;
  const auto model = SmallModel();
  const auto body = bodies.Get(model);
  ASSERT_TRUE(body.ok());
  EXPECT_EQ(*bodies.Get(model), *body);
  EXPECT_GT((*body)->volume_m3, 0);
}

TEST(BodyCache, KeepsNoMemoryOfBodiesThatNobodyUses) {
  constexpr size_t kBodies = 500;
  BodyCache bodies;
  const auto model = SmallModel();
  const auto make_and_forget = [&] {
    for (size_t i = 0; i < kBodies; ++i) ASSERT_TRUE(bodies.Get(model).ok());
  };
  make_and_forget();
  const size_t before = mallinfo2().uordblks;
  make_and_forget();
  // A sanitizer has a heap of its own, of which mallinfo2 knows nothing.
  EXPECT_LT(mallinfo2().uordblks, before + 50 * kBodies);
}

}  // namespace
}  // namespace carillon
