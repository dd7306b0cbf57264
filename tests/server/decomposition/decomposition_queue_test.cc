// SPDX-License-Identifier: Apache-2.0
#include <thread>

#include "proto/cpp/error_reason.h"
#include "server/base/sha256.h"
#include "server/decomposition/worker/worker_command.h"
#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

TEST_F(DecompositionQueueTest, AThousandSubmitsOfFiftyClientsComputeOnceAndAllAreTold) {
  MakeQueue(absl::StrCat(kCount, kSucceed));
  std::vector<v1::Job> jobs(1000);
  std::vector<std::thread> threads;
  threads.reserve(50);
  for (size_t client = 0; client < 50; ++client) {
    threads.emplace_back([&, client] {
      for (size_t i = client; i < jobs.size(); i += 50) {
        jobs[i] = SubmitAndAwaitEnd(Request(20'000));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const v1::Job& job : jobs) {
    EXPECT_EQ(job.name(), jobs.front().name());
    EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED);
  }
  EXPECT_EQ(RunCount(), 1U);
  EXPECT_TRUE(database_->models().Find(DigestOf(jobs.front())).ok());
}

TEST_F(DecompositionQueueTest, AKnownModelSucceedsAtOnceAfterARestart) {
  MakeQueue(kSucceed);
  const v1::Job done = SubmitAndAwaitEnd(Request(20'000));
  Open("carillon.db");
  MakeQueue("exit 1");
  EXPECT_EQ(Submit(Request(20'000)).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Submit(Request(5'000)).name(), done.name());
}

TEST_F(DecompositionQueueTest, AModelRemembersTheMaterialThatItWasLastAskedForWith) {
  MakeQueue(kSucceed);
  v1::CreateModalModelRequest request = Request(20'000);
  request.mutable_settings()->set_poisson_ratio(0.25);
  const v1::Job done = SubmitAndAwaitEnd(request);
  request.mutable_material()->set_preset("structural_steel");
  ASSERT_EQ(Submit(request).name(), done.name());
  const v1::Material material = database_->models().Material(DigestOf(done))->value();
  EXPECT_EQ(material.preset(), "structural_steel");
  // The ratio of the model, since the ratio of steel is another and would be refused.
  EXPECT_EQ(material.poisson_ratio(), 0.25);
}

TEST_F(DecompositionQueueTest, AModelThatIsNotCompleteFarEnoughIsComputedAgain) {
  MakeQueue(absl::StrCat(kCount, kSucceed));
  const v1::Job first = SubmitAndAwaitEnd(Request(10'000));
  const auto before = database_->models().Find(DigestOf(first));
  const v1::Job second = SubmitAndAwaitEnd(Request(20'000));
  EXPECT_EQ(second.name(), first.name());
  EXPECT_EQ(second.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(RunCount(), 2U);
  const auto after = database_->models().Find(DigestOf(first));
  EXPECT_GT((*after)->complete_to_eigenvalue, (*before)->complete_to_eigenvalue);
}

TEST_F(DecompositionQueueTest, AModelThatGoesNoFartherIsNotComputedForEver) {
  MakeQueue(absl::StrCat(kCount, "cp \"$here/model10\" \"$out\""));
  SubmitAndAwaitEnd(Request(20'000));
  EXPECT_EQ(Submit(Request(20'000)).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(RunCount(), 1U);
}

TEST_F(DecompositionQueueTest, ARefusalIsRememberedAcrossARestart) {
  WriteBytes(folder_ / "events", ErrorBytes("MESH_NOT_CLOSED"));
  MakeQueue(absl::StrCat(kCount, "cat \"$here/events\" >&3; exit 1"));
  EXPECT_EQ(SubmitAndAwaitEnd(Request(10'000)).error().reason(), "MESH_NOT_CLOSED");
  Open("carillon.db");
  MakeQueue(absl::StrCat(kCount, kSucceed));
  const v1::Job job = Submit(Request(20'000));
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(job.error().reason(), "MESH_NOT_CLOSED");
  EXPECT_EQ(RunCount(), 1U);
}

TEST_F(DecompositionQueueTest, ABodyOfUnclearUnitIsTriedAgainWhereTheRequestStatesOne) {
  WriteBytes(folder_ / "events", ErrorBytes("MESH_UNIT_UNCLEAR"));
  MakeQueue(absl::StrCat(kCount, "grep -q 'metres_per_unit: 1$' \"$request\" || ",
                         "{ cat \"$here/events\" >&3; exit 1; }\n", kSucceed));
  v1::CreateModalModelRequest stated = Request(20'000);
  stated.mutable_settings()->set_metres_per_unit(1);
  const v1::Job refused = SubmitAndAwaitEnd(Request(20'000));
  EXPECT_EQ(refused.error().reason(), "MESH_UNIT_UNCLEAR");
  EXPECT_EQ(Submit(Request(20'000)).state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(RunCount(), 1U);
  const v1::Job made = SubmitAndAwaitEnd(stated);
  EXPECT_EQ(made.name(), refused.name());
  EXPECT_EQ(made.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Submit(Request(20'000)).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(RunCount(), 2U);
}

TEST_F(DecompositionQueueTest, AJobUnderWhichTheDaemonDiesAgainAndAgainIsGivenUpUntilAskedAgain) {
  const auto request = ResolveRequest(Request(20'000));
  const std::string digest = RequestDigest(*request);
  JobRecord record{.digest = digest, .request = request->SerializeAsString()};
  record.start_count = 9;
  ASSERT_TRUE(database_->jobs().Put(record).ok());
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
  EXPECT_EQ((*database_->jobs().Find(digest))->start_count, 10U) << "its tenth start";
  queue_.reset();
  EXPECT_EQ((*database_->jobs().Find(digest))->start_count, 9U) << "an orderly end does not count";
  record.start_count = 10;
  ASSERT_TRUE(database_->jobs().Put(record).ok());
  MakeQueue(kSucceed);
  EXPECT_EQ(queue_->Get(digest)->error().reason(), "DECOMPOSITION_GIVEN_UP");
  EXPECT_EQ(SubmitAndAwaitEnd(Request(20'000)).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(DecompositionQueueTest, AModelThatBreaksTheRulesIsAFailureAndNotStored) {
  MakeQueue("echo 'no model' >\"$out\"");
  const v1::Job job = SubmitAndAwaitEnd(Request(20'000));
  EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(job.error().reason(), "MODAL_MODEL_MALFORMED");
  EXPECT_FALSE(database_->models().Find(DigestOf(job)).ok());
}

TEST_F(DecompositionQueueTest, QueuedAndRunningJobsGoOnAfterTheDaemonWasKilled) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
  const v1::Job running = Submit(Request(20'000, 1));
  Await(DigestOf(running), v1::JOB_STATE_RUNNING);
  const v1::Job queued = Submit(Request(20'000, 2));
  EXPECT_EQ(queued.state(), v1::JOB_STATE_QUEUED);
  // What kill -9 leaves: the database and its log as they are at this moment.
  std::filesystem::copy_file(folder_ / "carillon.db", folder_ / "copy.db");
  std::filesystem::copy_file(folder_ / "carillon.db-wal", folder_ / "copy.db-wal");
  Open("copy.db");
  MakeQueue(kSucceed);
  for (const v1::Job& job : {running, queued}) {
    EXPECT_EQ(AwaitEnd(DigestOf(job)).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_TRUE(database_->models().Find(DigestOf(job)).ok());
  }
}

TEST_F(DecompositionQueueTest, AJobWhoseModelWasStoredJustBeforeTheEndIsNotRunAgain) {
  const auto request = ResolveRequest(Request(20'000));
  const std::string digest = RequestDigest(*request);
  ASSERT_TRUE(
      database_->jobs().Put({.digest = digest, .request = request->SerializeAsString()}).ok());
  ASSERT_TRUE(database_->models().PutFile(digest, "", folder_ / "model20").ok());
  MakeQueue(kCount);
  EXPECT_EQ(queue_->Get(digest)->state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "runs"));
}

TEST_F(DecompositionQueueTest, ASubmitAfterACancelIsServedEvenIfTheWorkerStillDies) {
  const Gate gate(folder_ / "gate");
  const NamedPipe started(folder_ / "started");
  // The first run waits for ever, the second does not.
  MakeQueue(absl::StrCat("[ -e \"$here/ran\" ] || { touch \"$here/ran\"; echo >\"$here/started\"; ",
                         kWaitAtGate, "}\n", kSucceed));
  const v1::Job job = Submit(Request(20'000));
  ASSERT_TRUE(started.GetsAByte());
  EXPECT_TRUE(queue_->Cancel(DigestOf(job)).ok());
  EXPECT_EQ(SubmitAndAwaitEnd(Request(20'000)).state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(DecompositionQueueTest, AWatchMayEndItselfAndIsNotCalledAgain) {
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
  gate.Open();
  AwaitEnd(DigestOf(job));
  const std::lock_guard lock(mutex);
  EXPECT_EQ(calls_after_end, 0);
}

TEST_F(DecompositionQueueTest, RefusesMoreThanItCanRemember) {
  const Gate gate(folder_ / "gate");
  settings_.max_queued_count = 20;
  MakeQueue(kWaitAtGate);
  // One runs, the others wait.
  for (uint32_t i = 0; i <= settings_.max_queued_count; ++i) {
    ASSERT_TRUE(queue_->Submit(Request(20'000, 1 + i)).ok());
  }
  const auto refused = queue_->Submit(Request(20'000, 5'000));
  EXPECT_TRUE(absl::IsResourceExhausted(refused.status()));
  EXPECT_THAT(refused.status().ToString(), HasSubstr("QUEUE_FULL"));
  EXPECT_GE(std::stoi(ToErrorInfo(refused.status()).metadata().at("retry_after_s")), 1);
}

}  // namespace
}  // namespace carillon
