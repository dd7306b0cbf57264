// SPDX-License-Identifier: Apache-2.0
//
// The text forms of fixtures, of the requests of workers, and of addresses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/cpp/fixture_text.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/worker_request_text.h"

namespace carillon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Canonical(const std::string& text) {
  const auto fixture = ParseFixture(text);
  return fixture.ok() ? FixtureText(*fixture).value() : fixture.status().ToString();
}

TEST(FixtureText, IsReadAsItIsWritten) {
  for (const char* text : {"plane:0,0.1,-2.5/0,0,1", "box:0,0,0/0.1,0.2,1e-07", "vertices:0,3,17",
                           "group:base", "group:a name: with, all/sorts"}) {
    EXPECT_EQ(Canonical(text), text);
  }
}

TEST(FixtureText, OneFixtureHasOneText) {
  EXPECT_EQ(Canonical("vertices:3,1,3,2"), "vertices:1,2,3");
  EXPECT_EQ(Canonical("box:1,0,1/0,1,0"), "box:0,0,0/1,1,1");
  EXPECT_EQ(Canonical("plane:-0,1.50,0/0,0,2"), "plane:0,1.5,0/0,0,1");
}

TEST(FixtureText, WhatIsNoFixtureIsRefused) {
  for (const char* text :
       {"", "plane", "plane:0,0,0", "plane:0,0/0,0,1", "plane:0,0,x/0,0,1", "plane:0,0,0/0,0,0",
        "box:0,0,0/1,1,1/2", "box:0,0,0/1,1,inf", "vertices:", "vertices:1,-2", "vertices:1.5",
        "sphere:0,0,0/1", "group:", "group:two\nlines"}) {
    EXPECT_THAT(Canonical(text), HasSubstr("INVALID_SETTINGS: ")) << text;
  }
  v1::Fixture fixture;
  EXPECT_THAT(FixtureText(fixture).status().ToString(), HasSubstr("INVALID_SETTINGS: "));
  for (uint32_t i = 0; i <= kMaxFixedVertices; ++i) fixture.mutable_vertices()->add_indices(i);
  EXPECT_THAT(FixtureText(fixture).status().ToString(),
              HasSubstr("INVALID_SETTINGS: 10001 vertices are to be fixed; name 1 to 10000"));
}

TEST(WorkerRequestText, ReadsBackEveryDigitAndEveryByte) {
  worker::v1::WorkerRequest request;
  request.set_mesh_format("obj");
  request.mutable_settings()->set_poisson_ratio(-0.1);
  request.mutable_settings()->mutable_mesh()->set_keep_surface(false);
  request.mutable_settings()->add_fixtures()->set_group("END_OF_REQUEST\n\"' \u00e9");
  request.mutable_settings()->add_fixtures()->mutable_vertices()->add_indices(4'000'000'000);
  request.set_max_frequency_hz(1 / 3.0);
  const auto read = *ParseWorkerRequest(WorkerRequestText(request));
  EXPECT_EQ(read.SerializeAsString(), request.SerializeAsString());
}

// A group may be called as a shell script ends its input.
TEST(WorkerRequestText, HasNoLineThatIsOneWord) {
  worker::v1::WorkerRequest request;
  request.mutable_settings()->add_fixtures()->set_group("a\nEND_OF_REQUEST\nb");
  EXPECT_THAT(WorkerRequestText(request), ::testing::Not(HasSubstr("\nEND_OF_REQUEST\n")));
}

TEST(WorkerRequestText, RefusesASettingThatItDoesNotKnow) {
  const auto read = ParseWorkerRequest("mesh_format: \"obj\"\nsettings { colour: 3 }");
  EXPECT_THAT(read.status().ToString(),
              AllOf(HasSubstr("INVALID_SETTINGS"), HasSubstr("line 2"), HasSubstr("colour")));
}

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
