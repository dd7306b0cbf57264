// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/transfer_store.h"

#include <cmath>

#include "server/mode_database/maintenance/database_admin.h"
#include "tests/server/mode_database/database_fixture.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;

constexpr double kSoundSpeed = 343;

class TransferStoreTest : public DatabaseTest {
 protected:
  void PutModel(const ModalModel& model) {
    ASSERT_TRUE(DatabaseTest::PutModel(digest_, model).ok());
  }

  absl::Status Put(const ModalModel& model, double speed_ratio, float integral = 2,
                   Replacing replacing = Replacing::kAlways) {
    const std::vector<float> integrals(model.mode_count(), integral);
    const StoredTransfer transfer =
        SampleTransfer(model, {.speed_ratio = speed_ratio, .power_integrals = integrals});
    return database_->transfers().Put(digest_, transfer, replacing).status();
  }

  /// The power integral of the first mode for a material of this speed ratio; 0: no transfer.
  float Found(double speed_ratio) {
    const auto model = database_->models().Find(digest_);
    const auto transfer = database_->transfers().Find(**model, speed_ratio * kSoundSpeed);
    return transfer == nullptr ? 0 : transfer->power_integrals.front();
  }

  const std::string& digest_ = a_;
  const ModalModel model_ = SampleModel(3, 4);
};

TEST_F(TransferStoreTest, TheNearestTransferServesMaterialsWithinFivePercent) {
  PutModel(model_);
  ASSERT_TRUE(Put(model_, 10, 2).ok());
  ASSERT_TRUE(Put(model_, 10.6, 3).ok());
  EXPECT_EQ(Found(10.1), 2);
  EXPECT_EQ(Found(10.5), 3);
  EXPECT_EQ(Found(11.1), 3);
  EXPECT_EQ(Found(11.3), 0);
  EXPECT_EQ(Found(9.4), 0);
}

TEST_F(TransferStoreTest, TransfersOutliveTheDaemonAndGoWithTheRevisionOfTheirModel) {
  PutModel(model_);
  ASSERT_TRUE(Put(model_, 10).ok());
  Reopen();
  EXPECT_EQ(Found(10), 2);
  EXPECT_EQ(database_->transfers().List(digest_)->size(), 1U);
  const auto old = *database_->models().Find(digest_);
  PutModel(SampleModel(4, 4));
  EXPECT_EQ(Found(10), 0) << "the new revision has other modes";
  EXPECT_EQ(database_->transfers().Find(*old, 10 * kSoundSpeed), nullptr);
  EXPECT_TRUE(database_->transfers().List(digest_)->empty());
}

TEST_F(TransferStoreTest, ObjectsShareOneCopyAndTheListenerHearsOfEachTransfer) {
  PutModel(model_);
  std::vector<std::string> heard;
  database_->transfers().Listen([&](const std::string& digest) { heard.push_back(digest); });
  ASSERT_TRUE(Put(model_, 10, 2).ok());
  const auto model = *database_->models().Find(digest_);
  const auto first = database_->transfers().Find(*model, 10 * kSoundSpeed);
  EXPECT_EQ(database_->transfers().Find(*model, 10.02 * kSoundSpeed), first);
  ASSERT_TRUE(Put(model_, 10.01, 5).ok());  // of the same step: it replaces the first
  EXPECT_EQ(Found(10), 5);
  EXPECT_EQ(first->power_integrals.front(), 2) << "what sounds keeps its transfer";
  EXPECT_THAT(heard, ElementsAre(digest_, digest_));
}

TEST_F(TransferStoreTest, RefusesATransferOfOtherModes) {
  EXPECT_THAT(Put(model_, 10).ToString(), HasSubstr("MODAL_MODEL_NOT_FOUND"));
  PutModel(model_);
  ModalModel other = model_;
  other.eigenvalues.back() += 1e-9;
  EXPECT_THAT(Put(other, 10).ToString(), HasSubstr("TRANSFER_MALFORMED"));
  EXPECT_TRUE(database_->transfers().List(digest_)->empty());
}

TEST_F(TransferStoreTest, ATransferThatChangedOnTheDiskIsLeftOutAndReported) {
  PutModel(model_);
  ASSERT_TRUE(Put(model_, 10, 1.2345678F).ok());
  const float integral = 1.2345678F;
  FlipABitWithin({reinterpret_cast<const char*>(&integral), sizeof integral});
  std::vector<std::string> findings;
  const auto note = [&](const std::string& finding) { findings.push_back(finding); };
  database_.reset();
  ASSERT_TRUE(CheckDatabase(file_, note).ok());
  EXPECT_THAT(findings, ElementsAre(HasSubstr("a transfer of modalModels/")));
  Reopen();
  EXPECT_EQ(Found(10), 0);
  ASSERT_TRUE(Put(model_, 10, 2).ok());
  EXPECT_EQ(Found(10), 2);
}

TEST(StoredTransfer, AModeThatWasNotComputedHasTheEfficiencyOfTheNearestOneThatWas) {
  ModalModel model = SampleModel(3, 4);
  model.eigenvalues = {100, 400, 900};
  const Transfer transfer =
      SampleTransfer(
          model, {.states = {1, 1, 2}, .power_integrals = {8, 3, 0}, .normal_energies = {1, 2, 6}})
          .Decode();
  // Efficiency is proportional to eigenvalue * integral / energy: 400 * 3 / 2 = 900 * I / 6.
  EXPECT_THAT(transfer.power_integrals, Pointwise(testing::FloatNear(1e-6F), {8.0F, 3.0F, 4.0F}));
}

TEST(StoredTransfer, PatternsAreTheCoefficientsFarAwayOfUnitPower) {
  const Transfer transfer =
      SampleTransfer(SampleModel(3, 4), {.power_integrals = {1, 2, 3}, .harmonics = {0, 2, 8}})
          .Decode();
  EXPECT_THAT(transfer.first, testing::ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(transfer.harmonics, testing::ElementsAre(0, 2, 8));
  // (1 + i)/sqrt(2), times -i, -1 and i for l = 0, 1 and 2.
  const float part = std::sqrt(0.5F);
  EXPECT_THAT(transfer.pattern_re, Pointwise(testing::FloatNear(1e-6F), {part, -part, -part}));
  EXPECT_THAT(transfer.pattern_im, Pointwise(testing::FloatNear(1e-6F), {-part, -part, part}));
}

TEST(StoredTransfer, EveryDamageIsRefused) {
  const ModalModel model = SampleModel(3, 4);
  const float integral = 1.2345678F;
  const std::string whole = SampleTransferBytes(model, {.power_integrals = {1, integral, 3}});
  ASSERT_TRUE(StoredTransfer::Parse(whole).ok());
  for (size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(StoredTransfer::Parse(whole.substr(0, length)).ok()) << length;
  }
  EXPECT_THAT(StoredTransfer::Parse(SampleTransferBytes(model, {.power_integrals = {1, -2, 3}}))
                  .status()
                  .ToString(),
              HasSubstr("TRANSFER_MALFORMED"));
  std::string changed = whole;
  changed[changed.find(std::string(reinterpret_cast<const char*>(&integral), 4)) + 2] ^= 1;
  EXPECT_THAT(StoredTransfer::Parse(changed).status().ToString(), HasSubstr("TRANSFER_CORRUPT"));
}

class ModelImportTest : public TransferStoreTest {
 protected:
  absl::StatusOr<ModelSummary> Import(const ModalModel& model,
                                      Replacing replacing = Replacing::kNever,
                                      const std::string& label = "") {
    auto import = database_->models().Import(digest_, label, replacing);
    if (!import.ok()) return import.status();
    for (const v1::ModalModelRecord& record : SampleRecords(model)) {
      if (const absl::Status taken = import->Append(record); !taken.ok()) return taken;
    }
    auto summary = import->Finish();
    if (summary.ok()) kept_ = import->kept();
    return summary;
  }

  absl::Status PutTransfer(float integral, Replacing replacing, double speed_ratio = 14) {
    return Put(model_, speed_ratio, integral, replacing);
  }

  size_t StoredModeCount() {
    const auto model = database_->models().Find(digest_);
    return model.ok() ? (*model)->mode_count() : 0;
  }

  /// Changes a byte of the stored mode shapes.
  void Damage() {
    FlipABitWithin({reinterpret_cast<const char*>(model_.shapes.data()),
                    model_.shapes.size() * sizeof(float)});
  }

  bool kept_ = false;
};

TEST_F(ModelImportTest, OfTheSameContentChangesNothing) {
  const auto first = *Import(model_, Replacing::kNever, "first");
  EXPECT_FALSE(kept_);
  ASSERT_TRUE(database_->models().Update(digest_, {.add_tags = {"bell"}, .pinned = true}).ok());
  const auto second = *Import(model_, Replacing::kNever, "second");
  EXPECT_TRUE(kept_);
  EXPECT_EQ(second.revision, first.revision);
  EXPECT_EQ(second.label, "first");
  EXPECT_EQ(second.tags, std::vector<std::string>{"bell"});
  EXPECT_TRUE(second.pinned);
  ASSERT_TRUE(Import(model_, Replacing::kUnlessPinned).ok());
  EXPECT_EQ(database_->models().Summary(digest_)->revision, first.revision);
}

TEST_F(ModelImportTest, OfAnotherHeaderIsOtherContent) {
  ModalModel renamed = model_;
  renamed.complete_to_eigenvalue *= 2;
  ASSERT_TRUE(Import(model_).ok());
  EXPECT_EQ(Import(renamed).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(ModelImportTest, RepairsAModelThatHasChangedOnTheDisk) {
  ASSERT_TRUE(Import(model_).ok());
  Damage();
  ASSERT_TRUE(Import(model_).ok()) << "before anybody has noticed the damage";
  EXPECT_FALSE(kept_);
  EXPECT_EQ(StoredModeCount(), 3U);
  Damage();
  EXPECT_TRUE(absl::IsDataLoss(database_->models().Find(digest_).status()));
  ASSERT_TRUE(Import(model_).ok()) << "out of quarantine";
  EXPECT_EQ(StoredModeCount(), 3U);
}

TEST_F(ModelImportTest, AStoredModelGetsNoTransferFromAnImportThatMayNotReplace) {
  ASSERT_TRUE(Import(model_).ok());
  EXPECT_EQ(PutTransfer(1, Replacing::kNever).code(), absl::StatusCode::kAlreadyExists);
  ASSERT_TRUE(PutTransfer(1, Replacing::kAlways).ok());
  EXPECT_TRUE(PutTransfer(1, Replacing::kNever).ok()) << "it is the same";
  EXPECT_THAT(PutTransfer(2, Replacing::kNever).ToString(), HasSubstr("MODAL_MODEL_EXISTS"));
  EXPECT_TRUE(PutTransfer(2, Replacing::kUnlessPinned).ok());
  ASSERT_TRUE(database_->models().Update(digest_, {.pinned = true}).ok());
  EXPECT_THAT(PutTransfer(1, Replacing::kUnlessPinned).ToString(), HasSubstr("unpin"));
  EXPECT_TRUE(PutTransfer(1, Replacing::kUnlessPinned, 10).ok()) << "it replaces nothing";
  const auto stored = *database_->transfers().Read(digest_);
  ASSERT_EQ(stored.size(), 2U);
  EXPECT_EQ(stored.back().Decode().power_integrals.front(), 2);
}

}  // namespace
}  // namespace carillon
