// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/flood_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/clock.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

using testing::HasSubstr;

TEST(AllowedBytes, GrowWithWhatWasReceivedAndWithTime) {
  EXPECT_EQ(AllowedBytes(0, 0), 0U);
  EXPECT_EQ(AllowedBytes(6400, 10), 100 + 10'240U);
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

/// A guard beside that of the daemon, of which it sees the connections, too.
class FloodGuardTest : public ServedDaemon {
 protected:
  SystemClock clock_;
  LimitedLog log_{clock_, "clients", [](const std::string&) {}};
  ConnectionGate gate_{8};
  FloodGuard guard_{gate_, log_};
};

TEST_F(FloodGuardTest, RestsUntilSomebodyIsConnectedAndThenLooksTwentyTimesASecond) {
  EXPECT_TRUE(guard_.rests());
  CreateScene();
  EXPECT_GE(guard_.Look(), FloodGuard::kPeriod);
  EXPECT_FALSE(guard_.rests());
}

}  // namespace
}  // namespace carillon
