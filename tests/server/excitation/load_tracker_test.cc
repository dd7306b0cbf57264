// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/load_tracker.h"

#include <gtest/gtest.h>

#include <cmath>

namespace carillon {
namespace {

constexpr double kStepS = 1.0 / 60;
constexpr double kWeight = 9.81 * kStepS;  // the impulse that holds 1 kg up in one step

TEST(LoadTracker, ABodyThatRestsDoesNotStrikeThoughItsLoadJitters) {
  LoadTracker load;
  for (int i = 0; i < 8; ++i) load.Next(kWeight, kStepS);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(load.Next(kWeight * (1 + 0.5 * std::sin(1e6 * i)), kStepS), 0) << i;
  }
}

// A block that bounces with a restitution of 0.6, in the steps of 20 ms of a controller.
TEST(LoadTracker, ABounceAfterThirtyMillisecondsInTheAirIsABlowWhole) {
  LoadTracker load;
  EXPECT_EQ(load.Next(0.26, 0.02), 1);
  for (int i = 0; i < 6; ++i) load.Next(0, 0.02);
  EXPECT_EQ(load.Next(0.156, 0.02), 1);
  for (int i = 0; i < 3; ++i) load.Next(0, 0.02);
  EXPECT_EQ(load.Next(0.094, 0.02), 1);
  // In steps of 2 ms a gap of three is the jitter of a load.
  LoadTracker fine;
  fine.Next(0.26, 0.002);
  for (int i = 0; i < 3; ++i) fine.Next(0, 0.002);
  EXPECT_LT(fine.Next(0.094, 0.002), 0.1);
}

TEST(LoadTracker, ForgetsAContactThatIsLongOver) {
  LoadTracker load;
  load.Next(1, kStepS);
  EXPECT_FALSE(load.idle());
  for (int i = 0; i < 8; ++i) load.Next(0, kStepS);
  EXPECT_TRUE(load.idle());
}

}  // namespace
}  // namespace carillon
