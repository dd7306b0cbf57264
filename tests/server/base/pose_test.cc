// SPDX-License-Identifier: Apache-2.0
#include "server/base/pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace carillon {
namespace {

using testing::HasSubstr;

const Quaternion kQuarterAboutZ{.w = std::numbers::sqrt2 / 2, .z = std::numbers::sqrt2 / 2};
const Quaternion kQuarterAboutX{.w = std::numbers::sqrt2 / 2, .x = std::numbers::sqrt2 / 2};

void ExpectNear(const Vector3& a, const Vector3& b) {
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-15) << i;
}

TEST(Pose, AQuarterTurnAboutZTakesXToY) {
  ExpectNear(Rotated({1, 0, 0}, kQuarterAboutZ), {0, 1, 0});
  ExpectNear(Rotated({0, 1, 0}, Inverse(kQuarterAboutZ)), {1, 0, 0});
}

TEST(Pose, AProductTurnsByItsSecondFactorFirst) {
  const Vector3 x{1, 0, 0};
  ExpectNear(Rotated(x, Product(kQuarterAboutX, kQuarterAboutZ)),
             Rotated(Rotated(x, kQuarterAboutZ), kQuarterAboutX));
}

TEST(Pose, RefusesWhatIsNoPlaceOrNoRotation) {
  EXPECT_TRUE(Validate(Pose{.position_m = {1, -2e5, 3}, .orientation = kQuarterAboutX}).ok());
  EXPECT_TRUE(Validate(Quaternion{.w = 0.9995}).ok());
  for (const double wrong : {std::nan(""), std::numeric_limits<double>::infinity(), -2e6}) {
    EXPECT_THAT(Validate(Pose{.position_m = {0, wrong, 0}}).ToString(),
                HasSubstr("INVALID_POSE: "));
    EXPECT_THAT(Validate(Quaternion{.x = wrong}).ToString(), HasSubstr("INVALID_POSE: "));
  }
  EXPECT_FALSE(Validate(Quaternion{.w = 0}).ok());
  EXPECT_FALSE(Validate(Quaternion{.w = 0.99}).ok());
}

}  // namespace
}  // namespace carillon
