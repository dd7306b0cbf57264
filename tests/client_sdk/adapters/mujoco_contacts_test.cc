// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/mujoco_contacts.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <memory>
#include <numbers>
#include <string>

namespace carillon::adapters {
namespace {

constexpr double kRadiusM = 0.05;

mjModel* Load(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "world.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
  std::array<char, 500> error{};
  mjModel* model =
      mj_loadXML("world.xml", files.get(), error.data(), static_cast<int>(error.size()));
  mj_deleteVFS(files.get());
  EXPECT_NE(model, nullptr) << error.data();
  return model;
}

/// Two balls of 1 kg that meet without weight: the left one, of body 1, flies to the right; the
/// right one, of body 2, is turned by a quarter about z, so that x of the world is its -y.
class MujocoContactsTest : public testing::Test {
 public:
  MujocoContactsTest() { data_->qvel[0] = 1; }
  MujocoContactsTest(const MujocoContactsTest&) = delete;
  MujocoContactsTest& operator=(const MujocoContactsTest&) = delete;
  ~MujocoContactsTest() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

 protected:
  void Simulate() {
    for (int i = 0; i < 200; ++i) {
      mj_step(model_, data_);
      contacts_.Read(*data_, step_);
    }
  }

  mjModel* model_ = Load(
      "<mujoco><option timestep='0.001' gravity='0 0 0'/>"
      "<default><geom type='sphere' size='0.05' mass='1' friction='0 0 0'/></default><worldbody>"
      "<body><freejoint/><geom/></body>"
      "<body pos='0.11 0 0' quat='0.70710678 0 0 0.70710678'><freejoint/><geom/></body>"
      "</worldbody></mujoco>");
  mjData* data_ = mj_makeData(model_);
  MujocoContacts contacts_{{}, *model_};
  v1::ContactStep step_;
};

TEST_F(MujocoContactsTest, WhatIsNotHeardIsNotRead) {
  Simulate();
  EXPECT_EQ(step_.contacts_size(), 0);
  EXPECT_GT(data_->qvel[6], 0);  // they have met
}

TEST_F(MujocoContactsTest, AContactOfTwoObjectsIsOneRowWithASecondObject) {
  contacts_.AddObject(2, 4);
  contacts_.AddObject(1, 9);
  Simulate();
  ASSERT_GT(step_.contacts_size(), 0);
  const v1::Contact& contact = step_.contacts(0);
  EXPECT_EQ(contact.object(), 4U);
  EXPECT_EQ(contact.second().object(), 9U);
  EXPECT_NEAR(contact.point_m().y(), kRadiusM, 0.001);  // as deep as they are in one another
  EXPECT_NEAR(contact.second().point_m().x(), kRadiusM, 0.001);
  EXPECT_NEAR(contact.second().rotation().z(), std::numbers::sqrt2 / 2, 1e-6);
}

TEST_F(MujocoContactsTest, ImpulsesAddUpToTheChangeOfMomentum) {
  contacts_.AddObject(2, 4);
  Simulate();
  double sum = 0;
  for (const v1::Contact& contact : step_.contacts()) {
    EXPECT_NEAR(contact.impulse_newton_seconds().x(), 0, 1e-6);
    EXPECT_FALSE(contact.has_second());
    EXPECT_EQ(contact.hertz().striker_mass_kg(), 1);
    sum -= contact.impulse_newton_seconds().y();
  }
  EXPECT_GT(step_.contacts_size(), 1);  // a soft contact lasts
  EXPECT_GT(sum, 0.4);
  EXPECT_NEAR(sum, data_->qvel[6], 1e-6);
}

TEST_F(MujocoContactsTest, PosesAreThoseOfTheBodies) {
  contacts_.AddObject(2, 4);
  mj_step(model_, data_);
  contacts_.ReadPoses(*data_, step_);
  ASSERT_EQ(step_.poses().object_size(), 1);
  EXPECT_EQ(step_.poses().object(0), 4U);
  EXPECT_DOUBLE_EQ(step_.poses().position_m(0), 0.11);
  EXPECT_NEAR(step_.poses().orientation(3), std::numbers::sqrt2 / 2, 1e-6);
}

}  // namespace
}  // namespace carillon::adapters
