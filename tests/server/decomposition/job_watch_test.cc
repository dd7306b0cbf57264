// SPDX-License-Identifier: Apache-2.0
//
// Those who watch a job are told of all that becomes of it.
#include "absl/strings/str_cat.h"
#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;

using JobWatchTest = DecompositionQueueTest;

TEST_F(JobWatchTest, AWatchTellsEveryStateAndProgressThenEnds) {
  const Gate gate(folder_ / "gate");
  WriteBytes(folder_ / "events", ProgressBytes(0.75));
  MakeQueue(absl::StrCat(kWaitAtGate, "cat \"$here/events\" >&3\n", kSucceed));
  Submit(Request(20'000, 1));
  const v1::Job job = Submit(Request(20'000, 2));
  Diary diary;
  std::mutex mutex;
  double fraction = 0;
  const auto watch = queue_->Watch(DigestOf(job), [&](const v1::Job& now) {
    diary.Write(now);
    const std::lock_guard lock(mutex);
    fraction = std::max(fraction, now.progress().fraction());
  });
  gate.Open();
  gate.Open();
  diary.AwaitEnd();
  EXPECT_THAT(diary.states(),
              ElementsAre(v1::JOB_STATE_QUEUED, v1::JOB_STATE_RUNNING, v1::JOB_STATE_SUCCEEDED));
  const std::lock_guard lock(mutex);
  EXPECT_EQ(fraction, 0.75);
}

TEST_F(JobWatchTest, AWatchMayEndItselfAndIsNotCalledAgain) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
  const v1::Job job = Submit(Request(20'000));
  std::mutex mutex;
  std::unique_ptr<JobWatch> watch;
  bool ended = false;
  int calls_after_end = 0;
  auto made = queue_->Watch(DigestOf(job), [&](const v1::Job&) {
    const std::lock_guard lock(mutex);
    if (ended) ++calls_after_end;
    if (watch != nullptr) ended = true;
    watch.reset();
  });
  {
    const std::lock_guard lock(mutex);
    if (!ended) watch = *std::move(made);
  }
  Diary diary;
  const auto other = Watch(job, diary);
  gate.Open();
  diary.AwaitEnd();
  const std::lock_guard lock(mutex);
  EXPECT_EQ(calls_after_end, 0);
}

}  // namespace
}  // namespace carillon
