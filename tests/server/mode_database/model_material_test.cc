// SPDX-License-Identifier: Apache-2.0
#include "tests/server/mode_database/database_fixture.h"

namespace carillon {
namespace {

class ModelMaterialTest : public DatabaseTest {
 protected:
  void PutModel() { ASSERT_TRUE(DatabaseTest::PutModel(a_, SampleModel(3, 4), "bell").ok()); }

  static v1::Material Named(const std::string& preset) {
    v1::Material material;
    material.set_preset(preset);
    return material;
  }

  /// The name of the remembered material; empty: there is none.
  std::string Remembered() {
    const auto material = database_->models().Material(a_);
    EXPECT_TRUE(material.ok()) << material.status();
    return material.ok() && material->has_value() ? (*material)->preset() : "";
  }
};

TEST_F(ModelMaterialTest, IsKeptBeforeItsModelIsStoredAndWhenItIsReplaced) {
  ASSERT_TRUE(database_->models().RememberMaterial(a_, Named("bell_bronze")).ok());
  PutModel();
  PutModel();
  Reopen();
  EXPECT_EQ(Remembered(), "bell_bronze");
  const auto summary = database_->models().Summary(a_);
  ASSERT_TRUE(summary.ok() && summary->material.has_value()) << summary.status();
  EXPECT_EQ(summary->material->preset(), "bell_bronze");
}

TEST_F(ModelMaterialTest, TheNewestRequestSaysIt) {
  PutModel();
  EXPECT_EQ(Remembered(), "");
  ASSERT_TRUE(database_->models().RememberMaterial(a_, Named("steel")).ok());
  ASSERT_TRUE(database_->models().RememberMaterial(a_, Named("glass")).ok());
  EXPECT_EQ(Remembered(), "glass");
  const auto changed = database_->models().Update(a_, {.material = Named("oak")});
  ASSERT_TRUE(changed.ok()) << changed.status();
  EXPECT_EQ(changed->material->preset(), "oak");
  EXPECT_EQ(Remembered(), "oak");
}

}  // namespace
}  // namespace carillon
