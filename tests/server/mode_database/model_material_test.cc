// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/base/sha256.h"
#include "server/mode_database/mode_database.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

class ModelMaterialTest : public ::testing::Test {
 protected:
  ModelMaterialTest() { Reopen(); }

  void Reopen() {
    database_.reset();
    auto opened = ModeDatabase::Open(file_, clock_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    database_ = *std::move(opened);
  }

  void PutModel() {
    WriteRecords(folder_ / "model", SampleRecords(SampleModel(3, 4)));
    ASSERT_TRUE(database_->models().PutFile(digest_, "bell", folder_ / "model").ok());
  }

  static v1::Material Named(const std::string& preset) {
    v1::Material material;
    material.set_preset(preset);
    return material;
  }

  /// The name of the remembered material; empty: there is none.
  std::string Remembered() {
    const auto material = database_->models().Material(digest_);
    EXPECT_TRUE(material.ok()) << material.status();
    return material.ok() && material->has_value() ? (*material)->preset() : "";
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "carillon.db";
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_;
  const std::string digest_ = Sha256Hex("a");
};

TEST_F(ModelMaterialTest, IsKeptBeforeItsModelIsStoredAndWhenItIsReplaced) {
  ASSERT_TRUE(database_->models().RememberMaterial(digest_, Named("bell_bronze")).ok());
  PutModel();
  PutModel();
  Reopen();
  EXPECT_EQ(Remembered(), "bell_bronze");
  const auto summary = database_->models().Summary(digest_);
  ASSERT_TRUE(summary.ok() && summary->material.has_value()) << summary.status();
  EXPECT_EQ(summary->material->preset(), "bell_bronze");
}

TEST_F(ModelMaterialTest, TheNewestRequestSaysIt) {
  PutModel();
  EXPECT_EQ(Remembered(), "");
  ASSERT_TRUE(database_->models().RememberMaterial(digest_, Named("steel")).ok());
  ASSERT_TRUE(database_->models().RememberMaterial(digest_, Named("glass")).ok());
  EXPECT_EQ(Remembered(), "glass");
  const auto changed = database_->models().Update(digest_, {.material = Named("oak")});
  ASSERT_TRUE(changed.ok()) << changed.status();
  EXPECT_EQ(changed->material->preset(), "oak");
  EXPECT_EQ(Remembered(), "oak");
}

}  // namespace
}  // namespace carillon
