// SPDX-License-Identifier: Apache-2.0
//
// Jobs that have a coarse model first.
#include "server/decomposition/job/coarse_request.h"
#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

// Writes down which mesh is asked for, and computes: "coarse" for few nodes, else "fine".
constexpr char kKind[] = R"(
kind=fine
case $nodes in 300) kind=coarse;; esac
echo $kind >>"$here/runs"
)";
constexpr char kWriteKind[] = "cp \"$here/$kind\" \"$out\"\n";
constexpr char kFineWaitsAtGate[] = "case $kind in fine) read line <\"$here/gate\";; esac\n";

class CoarseFirstTest : public DecompositionQueueTest {
 protected:
  CoarseFirstTest() {
    options_.worker_count = 2;
    request_ = SampleRequest(mesh_);
    request_.set_coarse_first(true);
    request_.set_label("bowl");
    resolved_ = *ResolveRequest(request_);
    fine_ = RequestDigest(resolved_);
    coarse_ = RequestDigest(*CoarseRequest(resolved_, 5));
    WriteModel("fine", WantedEigenvalue(resolved_));
    WriteModel("coarse", WantedEigenvalue(resolved_), 300);
  }

  void MakeQueue(const std::string& script) {
    DecompositionQueueTest::MakeQueue(absl::StrCat(kKind, script));
  }

  void Submit() {
    const auto job = *queue_->Submit(request_);
    EXPECT_EQ(job.name(), absl::StrCat("jobs/", fine_));
  }

  uint32_t NodesAskedForBy(const std::string& digest) {
    const auto summary = database_->models().Summary(digest);
    EXPECT_TRUE(summary.ok()) << summary.status();
    return summary.ok() ? summary->header.settings().mesh().target_node_count() : 1;
  }

  v1::CreateModalModelRequest request_, resolved_;
  std::string fine_, coarse_;
};

TEST_F(CoarseFirstTest, TheCoarseModelIsThereUnderTheNameUntilTheFineOneReplacesIt) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kFineWaitsAtGate, kWriteKind));
  Submit();
  EXPECT_TRUE(Await(fine_, v1::JOB_STATE_RUNNING).coarse_ready());
  EXPECT_EQ(NodesAskedForBy(fine_), 300U);
  EXPECT_EQ(database_->models().Summary(fine_)->label, "bowl");
  const auto sounding = *database_->models().FindToSound(fine_);
  const int64_t revision = database_->models().Summary(fine_)->revision;
  gate.Open();
  const v1::Job job = AwaitEnd(fine_);
  EXPECT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_FALSE(job.coarse_ready());
  EXPECT_EQ(NodesAskedForBy(fine_), 0U);
  EXPECT_GT(database_->models().Summary(fine_)->revision, revision);
  EXPECT_EQ(sounding->eigenvalues.size(), 3U) << "what sounds keeps its model";
  EXPECT_EQ(Runs(), "coarse\nfine\n");
}

TEST_F(CoarseFirstTest, TheCoarseModelHasItsOwnNameAndIsNotComputedTwice) {
  MakeQueue(kWriteKind);
  Submit();
  AwaitEnd(fine_);
  EXPECT_EQ(NodesAskedForBy(coarse_), 300U);
  EXPECT_EQ(queue_->Submit(*CoarseRequest(resolved_, 5))->state(), v1::JOB_STATE_SUCCEEDED);
  ASSERT_TRUE(queue_->DeleteModel(fine_).ok());
  Submit();
  EXPECT_EQ(AwaitEnd(fine_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "coarse\nfine\nfine\n");
}

TEST_F(CoarseFirstTest, ADaemonKilledInBetweenGoesOnWithTheFineModel) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat(kFineWaitsAtGate, kWriteKind));
  Submit();
  Await(fine_, v1::JOB_STATE_RUNNING);
  Open("carillon.db");
  MakeQueue(kWriteKind);
  EXPECT_EQ(AwaitEnd(fine_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(NodesAskedForBy(fine_), 0U);
  EXPECT_EQ(Runs().rfind("coarse"), 0U) << "the coarse model is computed once";
}

TEST_F(CoarseFirstTest, ADaemonKilledBeforeTheCoarseModelIsThereComputesBothInOrder) {
  const Gate gate(folder_ / "gate");
  MakeQueue("read line <\"$here/gate\"\n");
  Submit();
  Await(coarse_, v1::JOB_STATE_RUNNING);
  EXPECT_EQ(queue_->Get(fine_)->state(), v1::JOB_STATE_QUEUED) << "though a worker is free";
  Open("carillon.db");
  std::filesystem::remove(folder_ / "runs");
  MakeQueue(kWriteKind);
  EXPECT_EQ(AwaitEnd(fine_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "coarse\nfine\n");
}

TEST_F(CoarseFirstTest, CancellingTheCoarseJobLetsTheFineOneStart) {
  const Gate gate(folder_ / "gate");
  MakeQueue(absl::StrCat("case $kind in coarse) read line <\"$here/gate\";; esac\n", kWriteKind));
  Submit();
  ASSERT_TRUE(queue_->Cancel(coarse_).ok());
  EXPECT_EQ(AwaitEnd(fine_).state(), v1::JOB_STATE_SUCCEEDED);
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
