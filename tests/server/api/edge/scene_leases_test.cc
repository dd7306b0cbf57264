// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/scene_leases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "server/api/edge/client_limits.h"

namespace carillon {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;

class SetClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override { return now; }
  int64_t UnixMs() const noexcept override { return 0; }
  std::chrono::nanoseconds now{seconds(1000)};
};

class SceneLeasesTest : public testing::Test {
 protected:
  SetClock clock_;
  std::set<std::string> open_{"a", "b"};
  SceneLeases leases_{clock_, seconds(60),
                      [this](const auto& each) { return open_.contains(each); }};
};

TEST_F(SceneLeasesTest, ASceneEndsAGraceAfterItsLastConnectionWasClosed) {
  leases_.Begin(1, "a", false);
  leases_.Use(1, "b");
  open_.erase("a");
  clock_.now += seconds(1000);
  EXPECT_THAT(leases_.Expired(), IsEmpty());
  EXPECT_EQ(leases_.StateOf(1).connection_count, 1U);
  EXPECT_FALSE(leases_.StateOf(1).ends_in_s);
  open_.erase("b");
  EXPECT_THAT(leases_.Expired(), IsEmpty());
  clock_.now += seconds(59);
  EXPECT_THAT(leases_.Expired(), IsEmpty());
  EXPECT_DOUBLE_EQ(*leases_.StateOf(1).ends_in_s, 1);
  clock_.now += seconds(1);
  EXPECT_THAT(leases_.Expired(), ElementsAre(1));
}

TEST_F(SceneLeasesTest, TheLongestAbandonedSceneMakesRoomFirst) {
  const auto any = [](uint64_t) { return true; };
  leases_.Begin(1, "a", false);
  leases_.Begin(2, "b", false);
  leases_.Begin(3, "c", false);
  open_ = {"a", "c"};
  EXPECT_EQ(leases_.LongestAbandoned(any), 2U);
  clock_.now += seconds(1);
  open_ = {"c"};
  EXPECT_EQ(leases_.LongestAbandoned(any), 2U);
  EXPECT_EQ(leases_.LongestAbandoned([](uint64_t scene) { return scene != 2; }), 1U);
  leases_.End(2);
  leases_.End(1);
  EXPECT_FALSE(leases_.LongestAbandoned(any));
}

TEST(ClientLimits, AClientHasAShareOfTheWholeAndGivesItBack) {
  ClientLimits limits(0.25);
  ClientPlace first = *limits.Take(Holding::kRendering, "a");
  {
    const ClientPlace second = *limits.Take(Holding::kRendering, "a");
    EXPECT_THAT(
        limits.Take(Holding::kRendering, "a").status().ToString(),
        testing::HasSubstr("CLIENT_LIMIT_REACHED: this client has 2 renderings already, its "
                           "share of 8"));
    EXPECT_TRUE(limits.Take(Holding::kRendering, "b").ok());
    EXPECT_TRUE(limits.Take(Holding::kListener, "a").ok());
    EXPECT_EQ(limits.count(Holding::kRendering), 2U);
  }
  EXPECT_TRUE(limits.Take(Holding::kRendering, "a").ok());
  const ClientPlace moved = std::move(first);
  EXPECT_EQ(limits.count(Holding::kRendering), 1U);
}

TEST(ClientLimits, TheMemoryOfAllRenderingsIsBounded) {
  constexpr Holding kMib = Holding::kRenderingMib;
  ClientLimits limits(0.5);
  const size_t half = MostRenderingMib() / 2;
  ClientPlace first(limits, kMib, "a");
  ClientPlace second(limits, kMib, "b");
  EXPECT_TRUE(first.Grow(half - 1).ok());
  EXPECT_TRUE(first.Grow(half).ok());
  EXPECT_THAT(first.Grow(half + 1).ToString(), testing::HasSubstr("CLIENT_LIMIT_REACHED"));
  EXPECT_EQ(limits.count(kMib), half);
  EXPECT_EQ(first.most(), half);
  EXPECT_TRUE(second.Grow(half).ok());
  ClientPlace third(limits, kMib, "c");
  EXPECT_THAT(third.Grow(2).ToString(), testing::HasSubstr("TOO_MANY_CALLS"));
  first = ClientPlace();
  EXPECT_TRUE(third.Grow(2).ok());
  EXPECT_EQ(limits.count(kMib), half + 2);
}

}  // namespace
}  // namespace carillon
