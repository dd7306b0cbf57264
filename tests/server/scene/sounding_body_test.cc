// SPDX-License-Identifier: Apache-2.0
#include "server/scene/sounding_body.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include "server/scene/body_impulses.h"
#include "tests/server/scene/stage.h"

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

TEST(SoundingObject, APointIsInMetresOfTheObjectAsLargeAsItIs) {
  Stage stage;
  ObjectProperties properties = SmallProperties();
  properties.material.size = 3;
  const PlacedObject placed = *stage.TryAdd(properties);
  ObjectContact contact = SmallImpulse(1).contact;
  // Half way up an edge of 0.3 m, from vertex 0 to vertex 2.
  contact.impulse.location = Point{0, 0.15, 0};
  BodyImpulses impulses;
  ASSERT_TRUE(
      FindBodyImpulses(contact, PointSource::kClient, placed.object, nullptr, impulses).ok());
  const TrianglePoint& at = impulses.by[0].impulse().at;
  for (size_t corner = 0; corner < 3; ++corner) {
    const uint32_t vertex = at.vertices[corner];
    EXPECT_NEAR(at.weights[corner], vertex == 0 || vertex == 2 ? 0.5 : 0, 1e-6);
  }
}

}  // namespace
}  // namespace carillon
