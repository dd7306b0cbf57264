// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/flood_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(FindFloodTest, LetsAConnectionHaveItsCallsAndSomeThatFail) {
  const ConnectionCalls before{.begun_count = 1000, .answered_count = 900, .failed_count = 10};
  EXPECT_THAT(
      FindFlood(before, {.begun_count = 1256, .answered_count = 990, .failed_count = 10}, 0.1),
      IsEmpty());
  EXPECT_THAT(
      FindFlood(before, {.begun_count = 3000, .answered_count = 2010, .failed_count = 990}, 0.1),
      IsEmpty());
}

TEST(FindFloodTest, FindsCallsThatNeverEndAndCallsThatFailWithoutEnd) {
  EXPECT_THAT(FindFlood({}, {.begun_count = 600}, 0.1), HasSubstr("600 open calls"));
  EXPECT_THAT(FindFlood({}, {.begun_count = 1100, .failed_count = 1100}, 0.4),
              HasSubstr("cancelled 1100 calls"));
}

TEST(FindFloodTest, ToleratesCallsThatEndWhileTheyAreCounted) {
  EXPECT_EQ((ConnectionCalls{.begun_count = 7, .answered_count = 8}.open_count()), 0U);
}

TEST(MostIdleBytesTest, GrowsWithOpenCallsWithWhatWasReceivedAndWithTime) {
  EXPECT_EQ(MostIdleBytes(0, 0, 0), kMostIdleBytes);
  EXPECT_EQ(MostIdleBytes(2, 0, 0), kMostIdleBytes + (4U << 20U));
  EXPECT_EQ(MostIdleBytes(512, 0, 0), kMostIdleBytes + (96U << 20U));
  EXPECT_EQ(MostIdleBytes(0, 6400, 10), kMostIdleBytes + 100 + 10'240);
}

using ConnectionCallsTest = ServedDaemon;

TEST_F(ConnectionCallsTest, AreCountedByConnection) {
  for (int i = 0; i < 4; ++i) CreateScene();
  std::vector<uint64_t> begun;
  for (const GrpcConnection& connection : ListConnections(0)) {
    EXPECT_THAT(connection.peer, HasSubstr("unix:pid-"));
    begun.push_back(ReadConnectionCalls(connection.id).value_or(ConnectionCalls{}).begun_count);
  }
  EXPECT_THAT(begun, testing::Contains(4));
}

}  // namespace
}  // namespace carillon
