// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/fixture_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carillon {
namespace {

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

TEST(FixtureText, WhatIsNoFixtureIsRefusedInWords) {
  for (const char* text :
       {"", "plane", "plane:0,0,0", "plane:0,0/0,0,1", "plane:0,0,x/0,0,1", "box:0,0,0/1,1,1/2",
        "vertices:", "vertices:1,-2", "vertices:1.5", "sphere:0,0,0/1"}) {
    EXPECT_THAT(Canonical(text),
                HasSubstr("does not say which part of the body is fixed; give plane:"))
        << text;
  }
  EXPECT_THAT(Canonical("plane:0,0,0/0,0,0"), HasSubstr("a normal longer than zero"));
  EXPECT_THAT(Canonical("box:0,0,0/1,1,inf"), HasSubstr("finite corners"));
  EXPECT_THAT(Canonical("group:"), HasSubstr("it must have 1 to 200"));
  EXPECT_THAT(Canonical("group:two\nlines"), HasSubstr("no line break"));
  v1::Fixture fixture;
  EXPECT_THAT(FixtureText(fixture).status().ToString(), HasSubstr("a fixture says nothing"));
  for (uint32_t i = 0; i <= kMaxFixedVertices; ++i) fixture.mutable_vertices()->add_indices(i);
  EXPECT_THAT(FixtureText(fixture).status().ToString(),
              HasSubstr("INVALID_SETTINGS: 10001 vertices are to be fixed; name 1 to 10000"));
}

}  // namespace
}  // namespace carillon
