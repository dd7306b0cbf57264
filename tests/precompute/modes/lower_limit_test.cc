// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/lower_limit.h"

#include <gtest/gtest.h>

#include <cmath>

namespace carillon::precompute {
namespace {

/// A body of which `factor * limit ^ power` eigenvalues lie below a limit, and `all` at most.
struct Body {
  double factor, power;
  int all;
  int counts = 0;

  absl::StatusOr<int> CountBelow(double limit) {
    ++counts;
    return static_cast<int>(std::min<double>(factor * std::pow(limit, power), all));
  }
};

// A solid, a wall, a wall whose limit was expected to be a solid's, a mesh all of whose modes lie
// below the limit, and a solid of fewer modes.
TEST(LowerLimit, LeavesAsManyModesAsAreAllowed) {
  const int asked = 200'000;
  for (Body body : {Body{0.2, 1.5, 1 << 30}, Body{2000, 0.5, 1 << 30}, Body{20, 1, 1 << 30},
                    Body{0.2, 1.5, 30'000}, Body{0.02, 1.5, 1 << 30}}) {
    SCOPED_TRACE(body.factor);
    const auto found =
        LowerLimit({.limit = 1e4, .count = asked, .asked_count = asked}, 1000, [&](double limit) {
          return body.CountBelow(limit);
        }).value();
    EXPECT_LE(found.count, 1000);
    EXPECT_GE(found.count, 500);
    EXPECT_EQ(found.count, *body.CountBelow(found.limit));
    EXPECT_EQ(found.asked_count, asked);
    EXPECT_LE(body.counts, 9);
  }
}

TEST(LowerLimit, ReturnsTheErrorOfACount) {
  const auto found = LowerLimit({.limit = 1, .count = 100, .asked_count = 100}, 10,
                                [](double) { return absl::InternalError("on an eigenvalue"); });
  EXPECT_EQ(found.status().message(), "on an eigenvalue");
}

TEST(LargestThat, IsTheLeastWhereNoneFits) {
  EXPECT_EQ(LargestThat(36, 5006, [](int count) { return count <= 700; }), 700);
  EXPECT_EQ(LargestThat(36, 5006, [](int) { return false; }), 36);
  EXPECT_EQ(LargestThat(36, 5006, [](int) { return true; }), 5006);
}

}  // namespace
}  // namespace carillon::precompute
