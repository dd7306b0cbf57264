// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/bullet_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace carillon::adapters {
namespace {

/// A ball that runs into one that rests and is turned by a quarter about z; read out after every
/// substep.
class BulletContactsTest : public testing::Test {
 protected:
  BulletContactsTest() : dispatcher_(&configuration_) {
    world_.setGravity({0, 0, 0});
    world_.setInternalTickCallback(
        [](btDynamicsWorld* world, btScalar) {
          auto& test = *static_cast<BulletContactsTest*>(world->getWorldUserInfo());
          test.contacts_.Read(test.dispatcher_, test.step_);
        },
        this);
    for (btRigidBody* body : {&left_, &right_}) world_.addRigidBody(body);
    left_.setLinearVelocity({1, 0, 0});
    const btQuaternion quarter({0, 0, 1}, std::numbers::pi_v<btScalar> / 2);
    right_.setWorldTransform(btTransform(quarter, {0.101F, 0, 0}));
  }
  void TearDown() override {
    for (btRigidBody* body : {&left_, &right_}) world_.removeRigidBody(body);
  }

  void Simulate() {
    for (int i = 0; i < 10; ++i) world_.stepSimulation(0.001F, 0);
  }

  btSphereShape ball_{0.05F};
  btRigidBody left_{{1, nullptr, &ball_, {1, 1, 1}}}, right_{{1, nullptr, &ball_, {1, 1, 1}}};
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  BulletContacts contacts_{{}};
  v1::ContactStep step_;
};

TEST_F(BulletContactsTest, WhatIsNotHeardIsNotRead) {
  Simulate();
  EXPECT_EQ(step_.contacts_size(), 0);
  EXPECT_GT(right_.getLinearVelocity().x(), 0);  // they have met
}

TEST_F(BulletContactsTest, AContactOfTwoObjectsIsOneRowWithASecondObject) {
  contacts_.AddObject(right_, 4);
  contacts_.AddObject(left_, 9);
  Simulate();
  ASSERT_GT(step_.contacts_size(), 0);
  for (const v1::Contact& contact : step_.contacts()) {
    EXPECT_EQ(contact.object(), 4U);
    EXPECT_EQ(contact.second().object(), 9U);
  }
  const v1::Contact& contact = step_.contacts(0);
  // In the frame of the right ball, x of the world is -y.
  EXPECT_GT(contact.impulse_newton_seconds().y(), -2);
  EXPECT_LT(contact.impulse_newton_seconds().y(), -1e-3);
  EXPECT_NEAR(contact.impulse_newton_seconds().x(), 0, 1e-6);
  EXPECT_NEAR(contact.point_m().y(), 0.05, 0.002);
  EXPECT_NEAR(contact.second().point_m().x(), 0.05, 0.002);
  // Back from there.
  EXPECT_NEAR(std::abs(contact.second().rotation().z()), std::numbers::sqrt2 / 2, 1e-6);
  EXPECT_GT(contact.second().rotation().w() * contact.second().rotation().z(), 0);
}

TEST_F(BulletContactsTest, ImpulsesAreTheChangeOfMomentumWithFrictionInTheFrameOfTheBody) {
  contacts_.AddObject(left_, 9);
  // Off centre, so that friction takes part; turned, so that the frames of body and world differ.
  right_.getWorldTransform().setOrigin({0.097F, 0.03F, 0});
  left_.getWorldTransform().setRotation({btVector3(1, 2, 3), 0.7F});
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < 10; ++i) {
    step_.Clear();
    world_.stepSimulation(0.001F, 0);
    for (const v1::Contact& contact : step_.contacts()) {
      EXPECT_FALSE(contact.has_second());
      const v1::Vec3& impulse = contact.impulse_newton_seconds();
      sum +=
          left_.getWorldTransform().getBasis() * btVector3(impulse.x(), impulse.y(), impulse.z());
    }
  }
  const btVector3 change = left_.getLinearVelocity() - btVector3(1, 0, 0);  // of 1 kg
  ASSERT_LT(change.x(), -0.1);
  ASSERT_GT(std::abs(change.y()), 0.01);
  EXPECT_LT((sum - change).length(), 1e-9);
}

TEST_F(BulletContactsTest, ABodyThatIsRemovedSoundsNoMoreAndIsNotTouched) {
  contacts_.AddObject(right_, 4);
  contacts_.AddObject(left_, 9);
  contacts_.RemoveObject(left_);
  Simulate();
  ASSERT_GT(step_.contacts_size(), 0);
  for (const v1::Contact& contact : step_.contacts()) {
    EXPECT_EQ(contact.object(), 4U);
    EXPECT_FALSE(contact.has_second());
  }
  v1::ContactStep step;
  contacts_.ReadPoses(step);
  EXPECT_EQ(step.poses().object_size(), 1);
}

TEST_F(BulletContactsTest, PosesAreThoseOfTheBodies) {
  contacts_.AddObject(right_, 4);
  contacts_.AddObject(left_, 9);
  Simulate();
  v1::ContactStep step;
  contacts_.ReadPoses(step);
  const v1::PoseColumns& poses = step.poses();
  ASSERT_EQ(poses.object_size(), 2);
  for (int i = 0; i < 2; ++i) {
    const btTransform& place = (poses.object(i) == 4 ? right_ : left_).getWorldTransform();
    EXPECT_EQ(poses.position_m(3 * i), place.getOrigin().x());
    EXPECT_EQ(poses.orientation(4 * i + 3), static_cast<float>(place.getRotation().z()));
  }
}

}  // namespace
}  // namespace carillon::adapters
