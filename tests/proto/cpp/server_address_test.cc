// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/server_address.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

TEST(ServerAddress, IsASocketOrEndsWithAPort) {
  for (const char* text : {"unix:/run/x.sock", "localhost:1", "127.0.0.1:65535", "[::1]:50051"}) {
    EXPECT_TRUE(IsServerAddress(text)) << text;
  }
  for (const char* text : {"", "unix:", "localhost", ":50051", "localhost:", "localhost:0",
                           "127.0.0.1:99999", "localhost:-1", "localhost:5005x", "/run/x.sock"}) {
    EXPECT_FALSE(IsServerAddress(text)) << text;
  }
}

TEST(ServerAddress, IsOnThisMachineIfItIsASocketOrALoopbackAddress) {
  for (const char* text :
       {"unix:/run/x.sock", "localhost:1", "127.0.0.1:1", "127.8.0.1:1", "[::1]:1"}) {
    EXPECT_TRUE(IsOnThisMachine(text)) << text;
  }
  for (const char* text : {"0.0.0.0:1", "10.0.0.1:1", "localhost.example.org:1",
                           "127.example.org:1", "[::2]:1", "127.0.0.1.example.org:1"}) {
    EXPECT_FALSE(IsOnThisMachine(text)) << text;
  }
}

}  // namespace
}  // namespace carillon
