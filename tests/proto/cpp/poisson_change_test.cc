// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/poisson_change.h"

#include <gtest/gtest.h>

#include <cmath>

namespace carillon {
namespace {

TEST(EigenvalueChange, IsExactForTorsionAndForTheBendingOfAPlate) {
  for (const double from : {0.2, 0.33}) {
    for (const double to : {0.1, 0.28, 0.4}) {
      EXPECT_NEAR(EigenvalueChange(-1 / (1 + from), from, to), (1 + from) / (1 + to), 1e-12);
      EXPECT_NEAR(EigenvalueChange(2 * from / (1 - from * from), from, to),
                  (1 - from * from) / (1 - to * to), 1e-12);
      EXPECT_DOUBLE_EQ(EigenvalueChange(0, from, to), 1);
    }
  }
}

TEST(EigenvalueChange, HasTheSlopeThatItIsGiven) {
  constexpr double kStep = 1e-5;
  for (const double from : {0.0, 0.02, 0.18, 0.28, 0.45}) {
    for (const double slope : {-1.2, -0.7, -0.1, 0.3, 0.9, 2.5}) {
      const double change =
          EigenvalueChange(slope, from, from + kStep) - EigenvalueChange(slope, from, from - kStep);
      EXPECT_NEAR(change / (2 * kStep), slope, 1e-4) << from;
    }
  }
}

}  // namespace
}  // namespace carillon
