// SPDX-License-Identifier: Apache-2.0
//
// What the queue answers while a write to the database does not come to its end.

#include <future>

#include "server/decomposition/job/coarse_request.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/decomposition/queue_fixture.h"
#include "tests/server/mode_database/faulty_vfs.h"

namespace carillon {
namespace {

// A worker for 1 node writes its model once it is let through gate1, one for 2 nodes reports
// progress each time it is let through gate2.
constexpr char kWork[] = R"(
case $nodes in
  1) read line <"$here/gate1" ;;
  2) read line <"$here/gate2"; cat "$here/events" >&3; read line <"$here/gate2" ;;
esac
cp "$here/model" "$out"
)";

class BusyDiskTest : public DecompositionQueueTest {
 protected:
  BusyDiskTest() {
    Open("busy.db");
    EXPECT_EQ(database_->meshes().Put("solid")->digest, mesh_);
    // Larger than SQLite's cache, so that writes begin long before a transaction ends. The node
    // count is that of coarse models.
    WriteModel("model", WantedEigenvalue(*ResolveRequest(Request(0))), 300,
               SampleModel(20, 40'000));
    WriteBytes(folder_ / "events", ProgressBytes(0.75));
    options_.worker_count = 2;
    MakeQueue(kWork);
  }
  void TearDown() override {
    FaultyDisk::ReleaseWrites();
    queue_.reset();
    database_.reset();  // before its disk
  }

  v1::CreateModalModelRequest Request(uint32_t node_count) {
    v1::CreateModalModelRequest request = SampleRequest(mesh_);
    request.mutable_settings()->mutable_mesh()->set_target_node_count(node_count);
    return request;
  }

  static std::string DigestOf(const v1::CreateModalModelRequest& request) {
    return RequestDigest(*ResolveRequest(request));
  }

  /// Submits a job, and returns its digest once it is in a state.
  std::string SubmitAndAwait(const v1::CreateModalModelRequest& request, v1::JobState state) {
    Submit(request);
    Await(DigestOf(request), state);
    return DigestOf(request);
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
    EXPECT_TRUE(ReturnsWhileHeld([&] { EXPECT_FALSE(queue_->List(0, "")->jobs.empty()); }))
        << "List waits for the disk";
    EXPECT_TRUE(ReturnsWhileHeld([&] {
      EXPECT_EQ(queue_->Get(running)->state(), v1::JOB_STATE_RUNNING);
    })) << "Get waits for the disk";
    Diary observer;
    std::unique_ptr<JobWatch> watch;
    EXPECT_TRUE(ReturnsWhileHeld([&] { watch = Watch(running, observer); }))
        << "Watch waits for the disk";
    observer.Await(v1::JOB_STATE_RUNNING);
    EXPECT_TRUE(ReturnsWhileHeld([&] { watch.reset(); })) << "the end of a watch waits";
    EXPECT_TRUE(FaultyDisk::AwaitHeldWrite());
  }

  const Gate gate1_{folder_ / "gate1"}, gate2_{folder_ / "gate2"};
  const FaultyDisk disk_;
};

TEST_F(BusyDiskTest, ReadersAndProgressAreServedWhileAModelIsStored) {
  const std::string first = SubmitAndAwait(Request(1), v1::JOB_STATE_RUNNING);
  Diary second;
  const auto watch = Watch(SubmitAndAwait(Request(2), v1::JOB_STATE_RUNNING), second);
  FaultyDisk::HoldWritesAfter(20);
  gate1_.Open();
  ASSERT_TRUE(FaultyDisk::AwaitHeldWrite());
  ExpectReadersAreServed(first);
  gate2_.Open();
  second.AwaitThat([](const v1::Job& job) { return job.progress().fraction() == 0.75; });
  EXPECT_TRUE(FaultyDisk::AwaitHeldWrite());
  FaultyDisk::ReleaseWrites();
  Await(first, v1::JOB_STATE_SUCCEEDED);
  gate2_.Open();
  second.Await(v1::JOB_STATE_SUCCEEDED);
}

TEST_F(BusyDiskTest, AResultWaitsForAProcessThatHoldsTheDatabase) {
  Diary observer;
  const auto watch = Watch(SubmitAndAwait(Request(1), v1::JOB_STATE_RUNNING), observer);
  const auto other = *SqliteConnection::Open(folder_ / "busy.db");
  ASSERT_TRUE(other->Run("BEGIN IMMEDIATE").ok());
  gate1_.Open();
  // A write gives up after 10 s.
  EXPECT_FALSE(observer.EndsWithin(std::chrono::seconds(12)));
  ASSERT_TRUE(other->Run("ROLLBACK").ok());
  observer.Await(v1::JOB_STATE_SUCCEEDED);
}

TEST_F(BusyDiskTest, ReadersAreServedWhileACoarseModelIsCopied) {
  v1::CreateModalModelRequest fine = Request(0);
  fine.set_coarse_first(true);
  SubmitAndAwait(*CoarseRequest(*ResolveRequest(fine), 5), v1::JOB_STATE_SUCCEEDED);
  const std::string running = SubmitAndAwait(Request(1), v1::JOB_STATE_RUNNING);
  FaultyDisk::HoldWritesAfter(20);
  auto submitted = std::async(std::launch::async, [&] { return queue_->Submit(fine); });
  ASSERT_TRUE(FaultyDisk::AwaitHeldWrite());
  EXPECT_FALSE(database_->jobs().Find(DigestOf(fine))->has_value()) << "the copy is not written";
  ExpectReadersAreServed(running);
  const auto keep_material = [](const std::string&, const v1::Material&) { return false; };
  EXPECT_TRUE(ReturnsWhileHeld([&] {
    EXPECT_TRUE(queue_->Submit(Request(1), {}, keep_material).ok());
  })) << "whoever asks for a job that runs waits for the copy";
  FaultyDisk::ReleaseWrites();
  ASSERT_TRUE(submitted.get().ok());
  EXPECT_TRUE(queue_->Get(DigestOf(fine))->coarse_ready());
  gate1_.Open();
  Await(running, v1::JOB_STATE_SUCCEEDED);
}

TEST_F(BusyDiskTest, ReadersAreServedWhileASubmitAndACancelAreStored) {
  const std::string running = SubmitAndAwait(Request(1), v1::JOB_STATE_RUNNING);
  FaultyDisk::HoldWritesAfter(0);
  auto submitted = std::async(std::launch::async, [&] { return queue_->Submit(Request(3)); });
  auto cancelled = std::async(std::launch::async, [&] { return queue_->Cancel(running); });
  ASSERT_TRUE(FaultyDisk::AwaitHeldWrite());
  ExpectReadersAreServed(running);
  FaultyDisk::ReleaseWrites();
  EXPECT_TRUE(submitted.get().ok());
  EXPECT_TRUE(cancelled.get().ok());
  Await(running, v1::JOB_STATE_CANCELLED);
}

}  // namespace
}  // namespace carillon
