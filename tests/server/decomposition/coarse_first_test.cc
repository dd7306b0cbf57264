// SPDX-License-Identifier: Apache-2.0
//
// Jobs that have a coarse model first.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "proto/cpp/mesh_format.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/job/coarse_request.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/worker/local_executor.h"
#include "tests/server/decomposition/scripted_worker.h"

namespace carillon {
namespace {

constexpr std::chrono::seconds kDeadline(60);

// Writes down which mesh is asked for, and computes: "coarse" for few nodes, else "fine".
constexpr char kKind[] = R"(
kind=fine
case $nodes in 300) kind=coarse;; esac
echo $kind >>"$here/runs"
)";
constexpr char kSucceed[] = "cp \"$here/$kind\" \"$out\"\n";
constexpr char kFineWaitsAtGate[] = "case $kind in fine) read line <\"$here/gate\";; esac\n";

/// The newest state of a job, for waiting.
class Observer {
 public:
  void See(const v1::Job& job) {
    const std::lock_guard lock(mutex_);
    job_ = job;
    changed_.notify_all();
  }

  template <typename Test>
  v1::Job Await(Test test) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, kDeadline, [&] { return test(job_); }));
    return job_;
  }

  v1::Job AwaitEnd() {
    return Await([](const v1::Job& job) { return job.state() >= v1::JOB_STATE_SUCCEEDED; });
  }

  v1::Job AwaitFineRun() {
    return Await([](const v1::Job& job) { return job.state() == v1::JOB_STATE_RUNNING; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  v1::Job job_;
};

class CoarseFirstTest : public ::testing::Test {
 protected:
  CoarseFirstTest() {
    Open();
    request_ = SampleRequest(database_->meshes().Put("solid")->digest);
    request_.set_coarse_first(true);
    request_.set_label("bowl");
    resolved_ = *ResolveRequest(request_);
    fine_ = RequestDigest(resolved_);
    coarse_ = RequestDigest(*CoarseRequest(resolved_, 5));
    WriteModel("fine", 0);
    WriteModel("coarse", 300);
  }

  void WriteModel(const std::string& name, uint32_t node_count) {
    ModalModel model = SampleModel(3, 4);
    model.complete_to_eigenvalue = WantedEigenvalue(resolved_);
    std::vector<v1::ModalModelRecord> records = SampleRecords(model);
    records[0].mutable_header()->mutable_settings()->mutable_mesh()->set_target_node_count(
        node_count);
    WriteRecords(folder_ / name, records);
  }

  void Open() {
    queue_.reset();
    database_.reset();
    database_ = *ModeDatabase::Open(folder_ / "carillon.db", clock_);
  }

  void MakeQueue(const std::string& script) {
    queue_.reset();
    options_.program = WriteWorkerScript(folder_.path(), absl::StrCat(kKind, script));
    options_.directory = folder_ / "running";
    queue_ = *DecompositionQueue::Make(*database_, *MakeLocalExecutor(options_, clock_), clock_);
  }

  void Submit() {
    const auto job = queue_->Submit(request_);
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->name(), absl::StrCat("jobs/", fine_));
  }

  std::unique_ptr<JobWatch> Watch(const std::string& digest, Observer& observer) {
    auto watch = queue_->Watch(digest, [&](const v1::Job& job) { observer.See(job); });
    EXPECT_TRUE(watch.ok()) << watch.status();
    return watch.ok() ? *std::move(watch) : nullptr;
  }

  uint32_t NodesAskedForBy(const std::string& digest) {
    const auto summary = database_->models().Summary(digest);
    EXPECT_TRUE(summary.ok()) << summary.status();
    return summary.ok() ? summary->header.settings().mesh().target_node_count() : 1;
  }

  std::string Runs() { return ReadBytes(folder_ / "runs"); }

  TemporaryFolder folder_;
  SystemClock clock_;
  LocalExecutorOptions options_{.worker_count = 2};
  v1::CreateModalModelRequest request_, resolved_;
  std::string fine_, coarse_;
  std::unique_ptr<ModeDatabase> database_;
  std::unique_ptr<DecompositionQueue> queue_;
};

TEST_F(CoarseFirstTest, TheCoarseModelIsThereUnderTheNameUntilTheFineOneReplacesIt) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kFineWaitsAtGate, kSucceed));
  Submit();
  Observer observer;
  const auto watch = Watch(fine_, observer);
  EXPECT_TRUE(observer.AwaitFineRun().coarse_ready());
  EXPECT_EQ(NodesAskedForBy(fine_), 300U);
  EXPECT_EQ(database_->models().Summary(fine_)->label, "bowl");
  const auto sounding = database_->models().FindToSound(fine_);
  ASSERT_TRUE(sounding.ok()) << sounding.status();
  const int64_t revision = database_->models().Summary(fine_)->revision;
  gate.Open();
  const v1::Job job = observer.AwaitEnd();
  EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_FALSE(job.coarse_ready());
  EXPECT_EQ(NodesAskedForBy(fine_), 0U);
  EXPECT_GT(database_->models().Summary(fine_)->revision, revision);
  EXPECT_EQ((*sounding)->eigenvalues.size(), 3U) << "what sounds keeps its model";
  EXPECT_EQ(Runs(), "coarse\nfine\n");
}

TEST_F(CoarseFirstTest, TheCoarseModelHasItsOwnNameAndIsNotComputedTwice) {
  MakeQueue(kSucceed);
  Submit();
  Observer observer;
  const auto watch = Watch(fine_, observer);
  observer.AwaitEnd();
  EXPECT_EQ(NodesAskedForBy(coarse_), 300U);
  EXPECT_EQ(queue_->Submit(*CoarseRequest(resolved_, 5))->state(), v1::JOB_STATE_SUCCEEDED);
  ASSERT_TRUE(queue_->DeleteModel(fine_).ok());
  Submit();
  Observer again;
  const auto watch_again = Watch(fine_, again);
  EXPECT_EQ(again.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "coarse\nfine\nfine\n");
}

TEST_F(CoarseFirstTest, ADaemonKilledInBetweenGoesOnWithTheFineModel) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kFineWaitsAtGate, kSucceed));
  Submit();
  {
    Observer observer;
    const auto watch = Watch(fine_, observer);
    observer.AwaitFineRun();
  }
  Open();
  MakeQueue(kSucceed);
  Observer observer;
  const auto watch = Watch(fine_, observer);
  EXPECT_EQ(observer.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(NodesAskedForBy(fine_), 0U);
  EXPECT_EQ(Runs().rfind("coarse"), 0U) << "the coarse model is computed once";
}

TEST_F(CoarseFirstTest, ADaemonKilledBeforeTheCoarseModelIsThereComputesBothInOrder) {
  const Gate gate(folder_ / "gate");
  MakeQueue("read line <\"$here/gate\"\n");
  Submit();
  {
    Observer observer;
    const auto watch = Watch(coarse_, observer);
    observer.AwaitFineRun();
    EXPECT_EQ(queue_->Get(fine_)->state(), v1::JOB_STATE_QUEUED) << "though a worker is free";
  }
  Open();
  std::filesystem::remove(folder_ / "runs");
  MakeQueue(kSucceed);
  Observer observer;
  const auto watch = Watch(fine_, observer);
  EXPECT_EQ(observer.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "coarse\nfine\n");
}

TEST_F(CoarseFirstTest, CancellingTheCoarseJobLetsTheFineOneStart) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat("case $kind in coarse) read line <\"$here/gate\";; esac\n", kSucceed));
  Submit();
  ASSERT_TRUE(queue_->Cancel(coarse_).ok());
  Observer observer;
  const auto watch = Watch(fine_, observer);
  EXPECT_EQ(observer.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_FALSE(database_->models().Summary(coarse_).ok());
}

TEST_F(CoarseFirstTest, AFineSurfaceIsTakenWithLinearElements) {
  const auto element = [&](uint64_t mesh_bytes) {
    return CoarseRequest(resolved_, mesh_bytes)->settings().element();
  };
  EXPECT_EQ(element(10'000), v1::ELEMENT_QUADRATIC);
  EXPECT_EQ(element(1'000'000), v1::ELEMENT_LINEAR);
  resolved_.mutable_settings()->set_element(v1::ELEMENT_LINEAR);
  EXPECT_FALSE(CoarseRequest(resolved_, 1'000'000).has_value()) << "it would be the same mesh";
}

}  // namespace
}  // namespace carillon
