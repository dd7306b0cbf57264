// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/peer_name.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

TEST(PeerName, ConnectionsOfOneProcessOverAUnixSocketAreOneClient) {
  EXPECT_EQ(ProcessOfPeer("unix:pid-42/7"), ProcessOfPeer("unix:pid-42/8"));
  EXPECT_NE(ProcessOfPeer("unix:pid-42/7"), ProcessOfPeer("unix:pid-4/7"));
}

TEST(PeerName, ConnectionsOfUnknownProcessesAndOverTcpAreClientsOfTheirOwn) {
  EXPECT_NE(ProcessOfPeer("unix:pid-0/7"), ProcessOfPeer("unix:pid-0/8"));
  EXPECT_NE(ProcessOfPeer("ipv4:127.0.0.1:7"), ProcessOfPeer("ipv4:127.0.0.1:8"));
}

}  // namespace
}  // namespace carillon
