// SPDX-License-Identifier: Apache-2.0
#include "tests/server/mode_database/database_fixture.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

using testing::HasSubstr;

class ModelImportTest : public DatabaseTest {
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
    const std::vector<float> integrals(model_.mode_count(), integral);
    const StoredTransfer transfer =
        SampleTransfer(model_, {.speed_ratio = speed_ratio, .power_integrals = integrals});
    return database_->transfers().Put(digest_, transfer, replacing).status();
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

  const std::string& digest_ = a_;
  const ModalModel model_ = SampleModel(3, 4);
  const ModalModel other_ = SampleModel(2, 4);
  bool kept_ = false;
};

TEST_F(ModelImportTest, OfTheSameContentChangesNothing) {
  const auto first = Import(model_, Replacing::kNever, "first");
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_FALSE(kept_);
  ASSERT_TRUE(database_->models().Update(digest_, {.add_tags = {"bell"}, .pinned = true}).ok());
  const auto second = Import(model_, Replacing::kNever, "second");
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_TRUE(kept_);
  EXPECT_EQ(second->revision, first->revision);
  EXPECT_EQ(second->label, "first");
  EXPECT_EQ(second->tags, std::vector<std::string>{"bell"});
  EXPECT_TRUE(second->pinned);
  ASSERT_TRUE(Import(model_, Replacing::kUnlessPinned).ok());
  EXPECT_EQ(database_->models().Summary(digest_)->revision, first->revision);
}

TEST_F(ModelImportTest, OfOtherContentIsRefusedUnlessItMayReplace) {
  ASSERT_TRUE(Import(model_).ok());
  const auto refused = Import(other_);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(refused.status().ToString(), HasSubstr("MODAL_MODEL_EXISTS: modalModels/"));
  EXPECT_EQ(StoredModeCount(), 3U);
  ASSERT_TRUE(database_->models().Update(digest_, {.pinned = true}).ok());
  EXPECT_THAT(Import(other_, Replacing::kUnlessPinned).status().ToString(),
              HasSubstr("the stored model is pinned"));
  EXPECT_EQ(StoredModeCount(), 3U);
  ASSERT_TRUE(database_->models().Update(digest_, {.pinned = false}).ok());
  ASSERT_TRUE(Import(other_, Replacing::kUnlessPinned).ok());
  EXPECT_FALSE(kept_);
  EXPECT_EQ(StoredModeCount(), 2U);
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
  const auto stored = database_->transfers().Read(digest_);
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_EQ(stored->size(), 2U);
  EXPECT_EQ(stored->back().Decode().power_integrals.front(), 2);
}

}  // namespace
}  // namespace carillon
