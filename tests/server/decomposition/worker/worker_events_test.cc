// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/worker_events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/server/decomposition/scripted_worker.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;

TEST(WorkerEvents, AreTheSameHoweverTheBytesAreCut) {
  const std::string bytes =
      ProgressBytes(0.25) + ProgressBytes(0.5) + ErrorBytes("MESH_NOT_CLOSED");
  for (size_t piece = 1; piece <= bytes.size(); ++piece) {
    WorkerEventReader reader;
    std::vector<double> fractions;
    std::vector<std::string> reasons;
    for (size_t at = 0; at < bytes.size(); at += piece) {
      ASSERT_TRUE(reader
                      .Feed(std::string_view(bytes).substr(at, piece),
                            [&](const worker::v1::WorkerEvent& event) {
                              if (event.has_error()) reasons.push_back(event.error().reason());
                              if (event.has_progress()) {
                                fractions.push_back(event.progress().fraction());
                              }
                            })
                      .ok());
    }
    EXPECT_THAT(fractions, ElementsAre(0.25, 0.5));
    EXPECT_THAT(reasons, ElementsAre("MESH_NOT_CLOSED"));
  }
}

TEST(WorkerEvents, RefusesGarbageWithoutKeepingIt) {
  const std::vector<std::string> garbage = {
      std::string(6, '\xff'),              // a length of no end
      std::string("\x80\x80\x80\x01", 4),  // a length of 2 MiB
      std::string(1, '\0'),                // an event that says nothing
      "\004text",                          // no protobuf
      "\x05\x12\x03\x0a\x01\xff",          // a reason that is no UTF-8
  };
  for (const std::string& bytes : garbage) {
    WorkerEventReader reader;
    EXPECT_TRUE(absl::IsDataLoss(reader.Feed(bytes, [](const worker::v1::WorkerEvent&) {})));
  }
}

}  // namespace
}  // namespace carillon
