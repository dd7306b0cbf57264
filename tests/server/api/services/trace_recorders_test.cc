// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/trace_recorders.h"

#include <gtest/gtest.h>

#include <memory>

namespace carillon {
namespace {

std::shared_ptr<const v1::ContactTraceRecord> AnyRecord() {
  return std::make_shared<const v1::ContactTraceRecord>();
}

TEST(TraceRecorder, TheBytesThatWaitAreBoundedAndFreedWhenTheyAreTooMany) {
  TraceRecorder recorder(1, [] {});
  const auto record = AnyRecord();
  constexpr size_t kQuarter = TraceRecorder::kMostWaitingBytes / 4;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(recorder.Add(record, kQuarter));
  EXPECT_FALSE(recorder.overflowed());
  EXPECT_FALSE(recorder.Add(record, 1));
  EXPECT_TRUE(recorder.overflowed());
  EXPECT_EQ(record.use_count(), 1);
  v1::ContactTraceRecord taken;
  EXPECT_FALSE(recorder.TryTake(taken));
}

TEST(TraceRecorder, ARecordThatWasTakenNoLongerCounts) {
  TraceRecorder recorder(1, [] {});
  v1::ContactTraceRecord taken;
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(recorder.Add(AnyRecord(), TraceRecorder::kMostWaitingBytes));
    EXPECT_TRUE(recorder.TryTake(taken));
  }
  EXPECT_FALSE(recorder.overflowed());
}

TEST(TraceRecorder, KeepsNothingForAClientThatHasGone) {
  TraceRecorder recorder(1, [] {});
  const auto record = AnyRecord();
  EXPECT_TRUE(recorder.Add(record, 1));
  recorder.Leave();
  EXPECT_FALSE(recorder.Add(record, 1));
  EXPECT_EQ(record.use_count(), 1);
}

}  // namespace
}  // namespace carillon
