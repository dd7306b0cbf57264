// SPDX-License-Identifier: Apache-2.0
//
// Which of the waiting jobs starts, and what the others wait for.
#include "server/decomposition/active_jobs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "absl/strings/str_cat.h"
#include "server/decomposition/fair_queue.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class ActiveJobsTest : public ::testing::Test {
 protected:
  void Add(const std::string& digest, uint64_t bytes, const std::string& transfer_of) {
    jobs_->Add({.record = {.digest = digest, .transfer_of = transfer_of, .label = "the " + digest},
                .request = {},
                .guess_bytes = bytes});
  }
  void AddModel(const std::string& digest, uint64_t bytes = 1) { Add(digest, bytes, ""); }
  void AddTransfer(const std::string& digest, uint64_t bytes = 1) { Add(digest, bytes, "model"); }

  /// Starts the jobs that can start, and returns their digests.
  std::vector<std::string> Start() {
    std::vector<std::string> started;
    while (const auto job = jobs_->BeginRun(clock_)) started.push_back(job->record.digest);
    return started;
  }

  void End(const std::string& digest) {
    jobs_->EndRun(digest);
    jobs_->Apply(digest, RunEnded{{.verdict = Verdict::kCancelled}});
  }

  v1::JobWait WaitOf(const std::string& digest) { return jobs_->View(digest)->wait(); }

  void MakeJobs(const JobCapacity& capacity) { jobs_ = std::make_unique<ActiveJobs>(capacity); }

  SystemClock clock_;
  std::unique_ptr<ActiveJobs> jobs_;
};

TEST_F(ActiveJobsTest, DecompositionsStartBeforeTransfersThatWaitedLonger) {
  MakeJobs({.worker_count = 1, .memory_budget_bytes = 100});
  AddTransfer("t");
  AddModel("a");
  AddModel("b");
  for (const char* digest : {"a", "b", "t"}) {
    EXPECT_THAT(Start(), ElementsAre(digest));
    End(digest);
  }
}

TEST_F(ActiveJobsTest, OneTransferRunsBesideTheDecompositionsOfAllWorkers) {
  MakeJobs({.worker_count = 2, .memory_budget_bytes = 100, .transfers_yield = true});
  for (const char* digest : {"s", "t"}) AddTransfer(digest);
  for (const char* digest : {"a", "b", "c"}) AddModel(digest);
  EXPECT_THAT(Start(), ElementsAre("a", "b", "s"));
  End("s");
  EXPECT_THAT(Start(), ElementsAre("t"));
}

TEST_F(ActiveJobsTest, TransfersUseIdleWorkersAndLeaveThemToDecompositions) {
  MakeJobs({.worker_count = 2, .memory_budget_bytes = 100, .transfers_yield = true});
  for (const char* digest : {"s", "t", "u"}) AddTransfer(digest);
  EXPECT_THAT(Start(), ElementsAre("s", "t"));
  for (const char* digest : {"a", "b", "c"}) AddModel(digest);
  EXPECT_THAT(Start(), ElementsAre("a", "b"));
  End("s");
  EXPECT_THAT(Start(), IsEmpty()) << "one transfer more than there are workers runs already";
  EXPECT_THAT(jobs_->BeginYielding(), IsEmpty()) << "no decomposition waits for memory";
}

TEST_F(ActiveJobsTest, TheYoungestTransfersYieldTheMemoryForADecomposition) {
  MakeJobs({.worker_count = 3, .memory_budget_bytes = 100, .transfers_yield = true});
  for (const char* digest : {"s", "t", "u"}) AddTransfer(digest, 30);
  EXPECT_THAT(Start(), ElementsAre("s", "t", "u"));
  AddModel("a", 70);
  EXPECT_THAT(Start(), IsEmpty());
  EXPECT_EQ(WaitOf("a").cause(), v1::WAIT_CAUSE_MEMORY);
  EXPECT_THAT(jobs_->BeginYielding(), ElementsAre("u", "t"));
  EXPECT_THAT(jobs_->BeginYielding(), IsEmpty()) << "they have been chosen";
  for (const char* digest : {"t", "u"}) {
    EXPECT_EQ(jobs_->EndRun(digest).stage, JobStage::kYields);
    jobs_->Apply(digest, RunEnded{{.verdict = Verdict::kCancelled}});
    EXPECT_EQ(jobs_->Find(digest)->stage, JobStage::kWaits);
  }
  EXPECT_THAT(Start(), ElementsAre("a"));
}

TEST_F(ActiveJobsTest, TellsWhatAJobWaitsFor) {
  MakeJobs({.worker_count = 1, .memory_budget_bytes = 100, .transfers_yield = true});
  AddModel("a");
  AddTransfer("s");
  EXPECT_FALSE(jobs_->View("a")->has_wait()) << "nothing keeps it from starting";
  Start();
  EXPECT_FALSE(jobs_->View("a")->has_wait()) << "it runs";
  EXPECT_GT(jobs_->View("a")->started_unix_ms(), 0);
  AddModel("b");
  AddModel("c");
  EXPECT_EQ(WaitOf("b").cause(), v1::WAIT_CAUSE_WORKER);
  EXPECT_EQ(WaitOf("b").earlier_job_count(), 0U);
  EXPECT_EQ(WaitOf("b").running_job_count(), 1U) << "the transfer does not hold it up";
  EXPECT_EQ(WaitOf("b").running_job_label(), "the a");
  EXPECT_EQ(WaitOf("c").earlier_job_count(), 1U);
  EXPECT_EQ(jobs_->ViewAll().at("c").wait().earlier_job_count(), 1U);
  jobs_->Add({.record = {.digest = "fine"}, .request = {}, .waits_for = "a"});
  EXPECT_EQ(WaitOf("fine").cause(), v1::WAIT_CAUSE_COARSE_MODEL);
}

/// Keeps the places in the queue of the jobs that it is given.
class PlaceSink final : public JobSink {
 public:
  void Take(const v1::Job& job) override { places[job.name()] = job.wait().earlier_job_count(); }
  void TakeBegin() override { ++begin_count; }

  std::map<std::string, uint32_t> places;
  int begin_count = 0;
};

TEST_F(ActiveJobsTest, ASinkGetsManyWaitingJobsInTimeLinearInTheirNumber) {
  MakeJobs({.worker_count = 1, .memory_budget_bytes = 100});
  constexpr uint32_t kJobCount = 20'000;
  AddModel("first");
  Start();
  for (uint32_t i = 0; i < kJobCount; ++i) AddModel(absl::StrCat("waits", i));
  const auto time_of = [this](auto call) {
    const auto begin = clock_.Monotonic();
    call();
    return clock_.Monotonic() - begin;
  };
  PlaceSink sink;
  const auto listed = time_of([this] { EXPECT_EQ(jobs_->ViewAll().size(), kJobCount + 1); });
  const auto taken = time_of([&] { jobs_->WatchAll(sink); });
  jobs_->Forget(sink);
  EXPECT_EQ(sink.begin_count, 1);
  EXPECT_EQ(sink.places.size(), kJobCount + 1);
  EXPECT_EQ(sink.places.at("jobs/waits0"), 0U);
  EXPECT_EQ(sink.places.at(absl::StrCat("jobs/waits", kJobCount - 1)), kJobCount - 1);
  // Both calls show every job once. An order of the queue for each job took 300 times as long.
  EXPECT_LT(taken, 20 * listed);
}

TEST_F(ActiveJobsTest, TellsThoseThatWatchWaitingJobsOfTheirPlaceInTheQueue) {
  MakeJobs({.worker_count = 1, .memory_budget_bytes = 100, .transfers_yield = true});
  for (const char* digest : {"a", "b", "c"}) AddModel(digest);
  Start();
  std::vector<uint32_t> told;
  const auto watcher = std::make_shared<Watcher>(
      [&](const v1::Job& job) { told.push_back(job.wait().earlier_job_count()); });
  jobs_->Watch("c", watcher).Tell();
  End("a");
  Start();
  for (const Notice& news : jobs_->NewsOfWaiting()) news.Tell();
  EXPECT_THAT(told, ElementsAre(1, 0));
}

TEST(FairQueue, ItsOrderIsThatOfTheStarts) {
  std::mt19937 random(7);
  FairQueue queue;
  for (const char* client : {"a", "b", "c"}) queue.NoteStart(client);
  std::map<std::string, FairQueue::Entry> entries;
  for (uint64_t number = 0; number < 60; ++number) {
    FairQueue::Entry entry{.client = std::string(1, static_cast<char>('a' + random() % 5)),
                           .priority = static_cast<int32_t>(random() % 3),
                           .number = number,
                           .digest = absl::StrCat(number)};
    queue.Add(entry);
    entries[entry.digest] = entry;
  }
  const std::vector<absl::string_view> views = queue.Order();
  const std::vector<std::string> order(views.begin(), views.end());
  std::vector<std::string> starts;
  while (const auto next = queue.Next()) {
    starts.push_back(*next);
    queue.NoteStart(entries.at(*next).client);
    queue.Remove(entries.at(*next));
  }
  EXPECT_EQ(starts.size(), entries.size());
  EXPECT_EQ(order, starts);
}

}  // namespace
}  // namespace carillon
