// SPDX-License-Identifier: Apache-2.0
//
// Jobs that compute the transfers of models.
#include <cmath>
#include <semaphore>
#include <utility>

#include "absl/strings/match.h"
#include "proto/cpp/material_catalogue.h"
#include "server/decomposition/job/wanted_job.h"
#include "tests/server/decomposition/queue_fixture.h"
#include "tests/server/mode_database/faulty_vfs.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

// Writes down what is asked for.
constexpr char kKind[] = R"(
kind=model
grep -q radiate_stored_model "$request" && kind=transfer
echo $kind >>"$here/runs"
)";
constexpr char kWriteKind[] = "cp \"$here/$kind\" \"$out\"\n";

class TransferJobTest : public DecompositionQueueTest {
 protected:
  TransferJobTest() {
    request_ = SampleRequest(mesh_);
    request_.set_label("bowl");
    const v1::CreateModalModelRequest resolved = *ResolveRequest(request_);
    digest_ = RequestDigest(resolved);
    transfer_ = WantedTransfer(digest_, resolved).digest;
    WriteModel("model", WantedEigenvalue(resolved));
    const v1::Material& material = resolved.material();
    const double speed = std::sqrt(material.young_pa() / material.density_kg_per_m3());
    WriteBytes(folder_ / "transfer",
               SampleTransferBytes(SampleModel(3, 4),
                                   {.speed_ratio = speed / 343, .power_integrals = {1, 2, 3}}));
  }

  void MakeQueue(const std::string& script, QueueSettings settings = {.transfers = true}) {
    settings_ = std::move(settings);
    DecompositionQueueTest::MakeQueue(absl::StrCat(kKind, script));
  }

  void Submit() { EXPECT_TRUE(queue_->Submit(request_).ok()); }

  size_t TransferCount() {
    const auto transfers = database_->transfers().List(digest_);
    return transfers.ok() ? transfers->size() : 0;
  }

  v1::CreateModalModelRequest request_;
  std::string digest_, transfer_;  // of the two jobs
};

// The disk becomes full at each of the writes that follow a run, and has space again once the queue
// has said that something waits for it.
TEST_F(TransferJobTest, AFullDiskLosesNeitherTheEndOfAJobNorItsTransfer) {
  const FaultyDisk disk;
  const Gate gate(folder_ / "gate");
  int failed_count = 0;
  for (int good_count = 0; good_count < 24; good_count += 3) {
    SCOPED_TRACE(good_count);
    Open(absl::StrCat("full", good_count, ".db"));
    database_->meshes().Put("solid").status().IgnoreError();
    std::counting_semaphore<> waits(0);
    MakeQueue(absl::StrCat("case $kind in model) read line <\"$here/gate\";; esac\n", kWriteKind),
              {.transfers = true,
               .log = [&](const std::string&) { waits.release(); },
               .log_event =
                   [&](const Event& event) {
                     if (absl::StartsWith(event.ToLine(), "job_not_stored what=job "))
                       waits.release();
                   }});
    Submit();
    Diary model;
    const auto watch = Watch(digest_, model);
    FaultyDisk::FailAfter(good_count, DiskFault::kFull);
    gate.Open();
    while (!waits.try_acquire() && !model.EndsWithin(std::chrono::milliseconds(10))) {
    }
    failed_count += FaultyDisk::Repair() ? 1 : 0;
    EXPECT_EQ(model.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(database_->jobs().Find(digest_)->value().state, v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(AwaitEnd(transfer_).state(), v1::JOB_STATE_SUCCEEDED);
    EXPECT_EQ(TransferCount(), 1U);
    queue_.reset();  // before what it tells
  }
  EXPECT_GT(failed_count, 5);
}

TEST_F(TransferJobTest, IsLeftOutWhereTheRequestOrTheDaemonSaysSo) {
  MakeQueue(kWriteKind, {});
  Submit();
  AwaitEnd(digest_);
  MakeQueue(kWriteKind);
  request_.set_without_transfer(true);
  Submit();
  EXPECT_FALSE(queue_->Get(transfer_).ok());
  request_.set_without_transfer(false);
  Submit();  // for a model that is stored
  EXPECT_EQ(AwaitEnd(transfer_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "model\ntransfer\n");
}

TEST_F(TransferJobTest, IsComputedOnceForAllMaterialsOfOneSpeedOfSound) {
  MakeQueue(kWriteKind, {});
  Submit();
  AwaitEnd(digest_);
  v1::CreateTransferRequest wanted;
  wanted.mutable_material()->set_preset("chime_aluminum");
  ASSERT_TRUE(queue_->SubmitTransfer(digest_, wanted).ok());
  EXPECT_EQ(AwaitEnd(transfer_).state(), v1::JOB_STATE_SUCCEEDED);
  *wanted.mutable_material() = *ResolveMaterial(wanted.material());
  wanted.mutable_material()->set_young_pa(2 * wanted.material().young_pa());
  wanted.mutable_material()->set_density_kg_per_m3(2 * wanted.material().density_kg_per_m3());
  const auto again = *queue_->SubmitTransfer(digest_, wanted);
  EXPECT_EQ(again.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "model\ntransfer\n");
  wanted.mutable_settings()->set_accuracy_db(0.5);
  ASSERT_TRUE(queue_->SubmitTransfer(digest_, wanted).ok());
  AwaitEnd(transfer_);
  EXPECT_EQ(Runs(), "model\ntransfer\ntransfer\n") << "a more exact one is another computation";
}

TEST_F(TransferJobTest, IsComputedAnewForAModelThatReplacesItsOwn) {
  MakeQueue(kWriteKind);
  Submit();
  AwaitEnd(digest_);
  AwaitEnd(transfer_);
  const WantedJob again =
      WantedTransfer(digest_, database_->transfers().List(digest_)->front().header, "bowl");
  EXPECT_EQ(again.digest, transfer_);
  EXPECT_TRUE(ResolveMaterial(again.request.material()).ok()) << "the worker would refuse it";
  v1::Material& softer = *request_.mutable_material();
  softer = *ResolveMaterial(softer);
  softer.set_young_pa(softer.young_pa() / 4);
  const v1::CreateModalModelRequest wider = *ResolveRequest(request_);
  ASSERT_EQ(RequestDigest(wider), digest_);
  WriteModel("model", WantedEigenvalue(wider));
  Submit();
  AwaitEnd(digest_);
  EXPECT_EQ(AwaitEnd(WantedTransfer(digest_, wider).digest).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(AwaitEnd(transfer_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "model\ntransfer\nmodel\ntransfer\ntransfer\n");
}

TEST_F(TransferJobTest, RefusesAModelThatIsNotStoredAndSettingsThatAreNone) {
  MakeQueue(kWriteKind);
  v1::CreateTransferRequest wanted;
  wanted.mutable_material()->set_preset("chime_aluminum");
  EXPECT_THAT(queue_->SubmitTransfer(digest_, wanted).status().ToString(),
              HasSubstr("MODAL_MODEL_NOT_FOUND"));
  wanted.mutable_settings()->set_accuracy_db(0.01);
  EXPECT_THAT(queue_->SubmitTransfer(digest_, wanted).status().ToString(),
              HasSubstr("INVALID_SETTINGS"));
}

TEST_F(TransferJobTest, IsMadeForAModelThatWasStoredJustBeforeTheDaemonDied) {
  ASSERT_TRUE(database_->models().PutFile(digest_, "bowl", folder_ / "model").ok());
  const std::string request = ResolveRequest(request_)->SerializeAsString();
  ASSERT_TRUE(database_->jobs().Put({.digest = digest_, .request = request}).ok());
  MakeQueue(kWriteKind);
  EXPECT_EQ(AwaitEnd(digest_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(AwaitEnd(transfer_).state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(Runs(), "transfer\n");
}

}  // namespace
}  // namespace carillon
