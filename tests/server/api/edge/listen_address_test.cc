// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/listen_address.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace carillon {
namespace {

TEST(ListenAddress, KeepsWhatItWasGiven) {
  for (const char* text : {"unix:/run/carillon/socket", "127.0.0.1:50051", "localhost:0",
                           "[::1]:443", "example.org:65535"}) {
    const absl::StatusOr<ListenAddress> address = ParseListenAddress(text);
    ASSERT_TRUE(address.ok()) << text;
    EXPECT_EQ(address->ToString(), text);
  }
}

TEST(ListenAddress, OnlyThisMachinesOwnAddressesAreLocal) {
  for (const char* text : {"unix:s", "127.0.0.1:1", "127.8.9.1:1", "localhost:1", "[::1]:1"}) {
    EXPECT_TRUE(ParseListenAddress(text)->is_local()) << text;
  }
  for (const char* text : {"0.0.0.0:1", "[::]:1", "10.0.0.1:1", "localhost.example.org:1"}) {
    EXPECT_FALSE(ParseListenAddress(text)->is_local()) << text;
  }
}

TEST(ListenAddress, RefusesAPathThatNoClientCouldReach) {
  for (const char* path : {"/tmp/a,b", "/tmp/a%20b", "/tmp/a?b", "/tmp/a#b"}) {
    EXPECT_THAT(
        ParseListenAddress(std::string("unix:") + path).status().ToString(),
        testing::AllOf(testing::HasSubstr("INVALID_CONFIGURATION: "), testing::HasSubstr(path)));
  }
  EXPECT_TRUE(ParseListenAddress("unix:/tmp/a b@c:d").ok());
}

TEST(ListenAddress, RefusesWhatIsNone) {
  for (const std::string& text :
       {std::string(), std::string("unix:"), std::string("localhost"), std::string(":80"),
        std::string("host:65536"), std::string("host:-1"), std::string("host:http"),
        std::string("::1:80"), std::string("[::1:80"), std::string("unix:/").append(107, 'x')}) {
    const absl::Status status = ParseListenAddress(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(status.ToString(), testing::HasSubstr("INVALID_CONFIGURATION: "));
  }
}

TEST(ListenAddress, KeepsAFileThatIsNoSocket) {
  const std::string folder = testing::TempDir() + "KeepsAFileThatIsNoSocket";
  std::filesystem::create_directory(folder);
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
  const std::string path = folder + "/thesis.txt";
  std::ofstream(path) << "years of work";
  for (const std::string& taken : {path, folder}) {
    EXPECT_THAT(PrepareSocket(taken).status().ToString(),
                testing::HasSubstr("LISTEN_FAILED: \"" + taken));
  }
  EXPECT_EQ(std::filesystem::file_size(path), 13U);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace carillon
