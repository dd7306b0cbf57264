// SPDX-License-Identifier: Apache-2.0
//
// What the queue answers while a write to the database does not come to its end.

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <vector>

#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/job/coarse_request.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/worker/local_executor.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/decomposition/scripted_worker.h"
#include "tests/server/mode_database/faulty_vfs.h"

namespace carillon {
namespace {

// Only a call that never returns takes this long.
constexpr std::chrono::seconds kDeadline(60);

// A worker for 1 node writes its model once it is let through gate1, one for 2 nodes reports
// progress each time it is let through gate2.
constexpr char kWork[] = R"(
case $nodes in
  1) read line <"$here/gate1" ;;
  2) read line <"$here/gate2"; cat "$here/events" >&3; read line <"$here/gate2" ;;
esac
cp "$here/model" "$out"
)";

/// The newest state of a job, for waiting.
class Observer {
 public:
  void See(const v1::Job& job) {
    const std::lock_guard lock(mutex_);
    job_ = job;
    changed_.notify_all();
  }

  bool Sees(const std::function<bool(const v1::Job&)>& test) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kDeadline, [&] { return test(job_); });
  }

  /// Returns whether the job leaves the state RUNNING within a time.
  bool Ends(std::chrono::seconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return job_.state() != v1::JOB_STATE_RUNNING; });
  }

  bool Sees(v1::JobState state) {
    return Sees([state](const v1::Job& job) { return job.state() == state; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  v1::Job job_;
};

class BusyDiskTest : public ::testing::Test {
 protected:
  BusyDiskTest() : gate1_(folder_ / "gate1"), gate2_(folder_ / "gate2") {
    database_ = *ModeDatabase::Open(folder_ / "carillon.db", clock_);
    mesh_ = database_->meshes().Put("solid")->digest;
    // Larger than SQLite's cache, so that writes begin long before a transaction ends.
    ModalModel model = SampleModel(20, 40'000);
    model.complete_to_eigenvalue = WantedEigenvalue(*ResolveRequest(Request(0)));
    std::vector<v1::ModalModelRecord> records = SampleRecords(model);
    // The node count of coarse models.
    records[0].mutable_header()->mutable_settings()->mutable_mesh()->set_target_node_count(300);
    WriteRecords(folder_ / "model", records);
    WriteBytes(folder_ / "events", ProgressBytes(0.75));
    const LocalExecutorOptions options{.program = WriteWorkerScript(folder_.path(), kWork),
                                       .directory = folder_ / "running",
                                       .worker_count = 2};
    queue_ = *DecompositionQueue::Make(*database_, *MakeLocalExecutor(options, clock_), clock_);
  }
  void TearDown() override { FaultyDisk::ReleaseWrites(); }

  v1::CreateModalModelRequest Request(uint32_t node_count) {
    v1::CreateModalModelRequest request = SampleRequest(mesh_);
    request.mutable_settings()->mutable_mesh()->set_target_node_count(node_count);
    return request;
  }

  static std::string DigestOf(const v1::CreateModalModelRequest& request) {
    return RequestDigest(*ResolveRequest(request));
  }

  std::unique_ptr<JobWatch> Watch(const std::string& digest, Observer& observer) {
    auto watch = queue_->Watch(digest, [&](const v1::Job& job) { observer.See(job); });
    EXPECT_TRUE(watch.ok()) << watch.status();
    return watch.ok() ? *std::move(watch) : nullptr;
  }

  std::unique_ptr<JobWatch> SubmitAndWatch(const v1::CreateModalModelRequest& request,
                                           Observer& observer) {
    EXPECT_TRUE(queue_->Submit(request).ok());
    return Watch(DigestOf(request), observer);
  }

  // Whether `call` returns while the disk holds a write. A call that waits for the disk is released
  // after the deadline, so that the test ends.
  static bool ReturnsWhileHeld(const std::function<void()>& call) {
    auto returned = std::async(std::launch::async, call);
    const bool in_time = returned.wait_for(kDeadline) == std::future_status::ready;
    if (!in_time) FaultyDisk::ReleaseWrites();
    return in_time;
  }

  // List, Get and Watch of `running`, a job that runs, return while the disk holds a write.
  void ExpectReadersAreServed(const std::string& running) {
    EXPECT_TRUE(ReturnsWhileHeld([&] {
      const auto page = queue_->List(0, "");
      ASSERT_TRUE(page.ok()) << page.status();
      EXPECT_FALSE(page->jobs.empty());
    })) << "List waits for the disk";
    EXPECT_TRUE(ReturnsWhileHeld([&] {
      const auto job = queue_->Get(running);
      ASSERT_TRUE(job.ok()) << job.status();
      EXPECT_EQ(job->state(), v1::JOB_STATE_RUNNING);
    })) << "Get waits for the disk";
    Observer observer;
    std::unique_ptr<JobWatch> watch;
    EXPECT_TRUE(ReturnsWhileHeld([&] { watch = Watch(running, observer); }))
        << "Watch waits for the disk";
    EXPECT_TRUE(observer.Sees(v1::JOB_STATE_RUNNING));
    EXPECT_TRUE(ReturnsWhileHeld([&] { watch.reset(); })) << "the end of a watch waits";
    EXPECT_TRUE(FaultyDisk::AwaitHeldWrite());
  }

  TemporaryFolder folder_;
  const Gate gate1_, gate2_;
  const FaultyDisk disk_;
  SystemClock clock_;
  std::string mesh_;
  std::unique_ptr<ModeDatabase> database_;
  std::unique_ptr<DecompositionQueue> queue_;
};

TEST_F(BusyDiskTest, ReadersAndProgressAreServedWhileAModelIsStored) {
  Observer first, second;
  const auto watch1 = SubmitAndWatch(Request(1), first);
  const auto watch2 = SubmitAndWatch(Request(2), second);
  ASSERT_TRUE(first.Sees(v1::JOB_STATE_RUNNING));
  ASSERT_TRUE(second.Sees(v1::JOB_STATE_RUNNING));
  FaultyDisk::HoldWritesAfter(20);
  gate1_.Open();
  ASSERT_TRUE(FaultyDisk::AwaitHeldWrite());
  ExpectReadersAreServed(DigestOf(Request(1)));
  gate2_.Open();
  EXPECT_TRUE(second.Sees([](const v1::Job& job) { return job.progress().fraction() == 0.75; }))
      << "progress waits for the disk";
  EXPECT_TRUE(FaultyDisk::AwaitHeldWrite());
  FaultyDisk::ReleaseWrites();
  EXPECT_TRUE(first.Sees(v1::JOB_STATE_SUCCEEDED));
  gate2_.Open();
  EXPECT_TRUE(second.Sees(v1::JOB_STATE_SUCCEEDED));
}

TEST_F(BusyDiskTest, AResultWaitsForAProcessThatHoldsTheDatabase) {
  Observer observer;
  const auto watch = SubmitAndWatch(Request(1), observer);
  ASSERT_TRUE(observer.Sees(v1::JOB_STATE_RUNNING));
  const auto other = *SqliteConnection::Open(folder_ / "carillon.db");
  ASSERT_TRUE(other->Run("BEGIN IMMEDIATE").ok());
  gate1_.Open();
  // A write gives up after 10 s.
  EXPECT_FALSE(observer.Ends(std::chrono::seconds(12)));
  ASSERT_TRUE(other->Run("ROLLBACK").ok());
  EXPECT_TRUE(observer.Sees(v1::JOB_STATE_SUCCEEDED));
}

TEST_F(BusyDiskTest, ReadersAreServedWhileACoarseModelIsCopied) {
  v1::CreateModalModelRequest fine = Request(0);
  fine.set_coarse_first(true);
  Observer coarse, running;
  const auto watch_coarse = SubmitAndWatch(*CoarseRequest(*ResolveRequest(fine), 5), coarse);
  ASSERT_TRUE(coarse.Sees(v1::JOB_STATE_SUCCEEDED));
  const auto watch_running = SubmitAndWatch(Request(1), running);
  ASSERT_TRUE(running.Sees(v1::JOB_STATE_RUNNING));
  FaultyDisk::HoldWritesAfter(20);
  auto submitted = std::async(std::launch::async, [&] { return queue_->Submit(fine); });
  ASSERT_TRUE(FaultyDisk::AwaitHeldWrite());
  EXPECT_FALSE(database_->jobs().Find(DigestOf(fine))->has_value()) << "the copy is not written";
  ExpectReadersAreServed(DigestOf(Request(1)));
  const auto keep_material = [](const std::string&, const v1::Material&) { return false; };
  EXPECT_TRUE(ReturnsWhileHeld([&] {
    EXPECT_TRUE(queue_->Submit(Request(1), {}, keep_material).ok());
  })) << "whoever asks for a job that runs waits for the copy";
  FaultyDisk::ReleaseWrites();
  ASSERT_TRUE(submitted.get().ok());
  EXPECT_TRUE(queue_->Get(DigestOf(fine))->coarse_ready());
  gate1_.Open();
  EXPECT_TRUE(running.Sees(v1::JOB_STATE_SUCCEEDED));
}

TEST_F(BusyDiskTest, ReadersAreServedWhileASubmitAndACancelAreStored) {
  Observer running;
  const auto watch = SubmitAndWatch(Request(1), running);
  ASSERT_TRUE(running.Sees(v1::JOB_STATE_RUNNING));
  FaultyDisk::HoldWritesAfter(0);
  auto submitted = std::async(std::launch::async, [&] { return queue_->Submit(Request(3)); });
  auto cancelled =
      std::async(std::launch::async, [&] { return queue_->Cancel(DigestOf(Request(1))); });
  ASSERT_TRUE(FaultyDisk::AwaitHeldWrite());
  ExpectReadersAreServed(DigestOf(Request(1)));
  FaultyDisk::ReleaseWrites();
  EXPECT_TRUE(submitted.get().ok());
  EXPECT_TRUE(cancelled.get().ok());
  EXPECT_TRUE(running.Sees(v1::JOB_STATE_CANCELLED));
}

}  // namespace
}  // namespace carillon
