// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/ode_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

namespace carillon::adapters {
namespace {

constexpr double kStepS = 0.001;
constexpr double kRadiusM = 0.05;

/// A world of ODE's own in which balls without friction run into one another; read out after every
/// step.
class OdeContactsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { dInitODE2(0); }
  static void TearDownTestSuite() { dCloseODE(); }

  void TearDown() override {
    dJointGroupDestroy(joints_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }

  /// Makes a body of 1 kg, turned by `angle` about z.
  dBodyID AddBall(double x, double speed, double angle = 0) {
    dBodyID body = dBodyCreate(world_);
    dMass mass;
    dMassSetSphereTotal(&mass, 1, kRadiusM);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, x, 0, 0);
    dBodySetLinearVel(body, speed, 0, 0);
    const dQuaternion turned{std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
    dBodySetQuaternion(body, turned);
    dGeomSetBody(dCreateSphere(space_, kRadiusM), body);
    return body;
  }

  /// A wall at `x`, which belongs to no body.
  void AddWall(double x) { dCreatePlane(space_, -1, 0, 0, -x); }

  void Simulate() {
    for (int i = 0; i < 20; ++i) {
      dSpaceCollide(space_, this, [](void* test, dGeomID a, dGeomID b) {
        static_cast<OdeContactsTest*>(test)->Meet(a, b);
      });
      dWorldStep(world_, kStepS);
      contacts_.Read(kStepS, step_);
      dJointGroupEmpty(joints_);
    }
  }

  void Meet(dGeomID a, dGeomID b) {
    if (swapped_) std::swap(a, b);
    dContact contact{};
    if (dCollide(a, b, 1, &contact.geom, sizeof(dContact)) == 0) return;
    contact.surface.mode = dContactBounce;
    contact.surface.bounce = 0.5;
    dJointID joint = dJointCreateContact(world_, joints_, &contact);
    dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
    contacts_.Add(joint, contact.geom);
  }

  dWorldID world_ = dWorldCreate();
  dSpaceID space_ = dSimpleSpaceCreate(nullptr);
  dJointGroupID joints_ = dJointGroupCreate(0);
  bool swapped_ = false;  // how the joints order their bodies
  OdeContacts contacts_{{}};
  v1::ContactStep step_;
};

/// Of a pair that meets, the right ball turned by a quarter: in its frame x of the world is -y.
class OdePair : public OdeContactsTest, public testing::WithParamInterface<bool> {
 protected:
  OdePair() { swapped_ = GetParam(); }

  void Hear() {
    contacts_.AddObject(right_, 4);
    contacts_.AddObject(left_, 9);
  }

  dBodyID left_ = AddBall(0, 1);
  dBodyID right_ = AddBall(2 * kRadiusM + 0.001, 0, std::numbers::pi / 2);
};

INSTANTIATE_TEST_SUITE_P(HoweverTheJointOrdersThem, OdePair, testing::Bool());

TEST_P(OdePair, WhatIsNotHeardIsNotRead) {
  Simulate();
  EXPECT_EQ(step_.contacts_size(), 0);
  EXPECT_GT(dBodyGetLinearVel(right_)[0], 0);  // they have met
}

TEST_P(OdePair, AContactOfTwoObjectsIsOneRowWithASecondObject) {
  Hear();
  Simulate();
  ASSERT_GT(step_.contacts_size(), 0);
  for (const v1::Contact& contact : step_.contacts()) {
    EXPECT_EQ(contact.object(), 4U);
    EXPECT_EQ(contact.second().object(), 9U);
    EXPECT_EQ(contact.partner(), step_.contacts(0).partner());
  }
  const v1::Contact& contact = step_.contacts(0);
  EXPECT_NEAR(contact.point_m().y(), kRadiusM, 0.002);  // as deep as they are in one another
  EXPECT_NEAR(contact.second().point_m().x(), kRadiusM, 0.002);
  // Back from the turned frame: -y is x again.
  EXPECT_NEAR(contact.second().rotation().w(), std::numbers::sqrt2 / 2, 1e-12);
  EXPECT_NEAR(contact.second().rotation().z(), std::numbers::sqrt2 / 2, 1e-12);
}

TEST_P(OdePair, ImpulsesAreTheChangeOfMomentumOfBoth) {
  Hear();
  Simulate();
  double sum = 0;
  for (const v1::Contact& contact : step_.contacts()) {
    const v1::Vec3& impulse = contact.impulse_newton_seconds();
    EXPECT_NEAR(impulse.x(), 0, 1e-12);
    sum -= impulse.y();
  }
  EXPECT_GT(sum, 0.5);
  // Of the one that is struck, and by the opposite of the one that strikes; 1 kg each.
  EXPECT_NEAR(sum, dBodyGetLinearVel(right_)[0], 1e-9);
  EXPECT_NEAR(-sum, dBodyGetLinearVel(left_)[0] - 1, 1e-9);
}

TEST_P(OdePair, WhereOneIsHeardThereIsNoSecondObject) {
  contacts_.AddObject(left_, 9);
  Simulate();
  ASSERT_GT(step_.contacts_size(), 0);
  const v1::Contact& contact = step_.contacts(0);
  EXPECT_EQ(contact.object(), 9U);
  EXPECT_FALSE(contact.has_second());
  EXPECT_LT(contact.impulse_newton_seconds().x(), -0.5);
}

TEST_P(OdePair, AWallThatIsNoBodyIsNoSecondObject) {
  Hear();
  AddWall(2 * kRadiusM + 0.001 + kRadiusM - 0.0005);  // the right ball touches it
  Simulate();
  double sum = 0;
  for (const v1::Contact& contact : step_.contacts()) {
    if (contact.has_second()) continue;
    EXPECT_EQ(contact.object(), 4U);
    sum -= contact.impulse_newton_seconds().y();
  }
  // All that the two have lost together.
  EXPECT_LT(sum, -0.05);
  EXPECT_NEAR(sum, dBodyGetLinearVel(left_)[0] + dBodyGetLinearVel(right_)[0] - 1, 1e-9);
}

TEST_P(OdePair, PosesAreThoseOfTheBodies) {
  Hear();
  Simulate();
  v1::ContactStep step;
  contacts_.ReadPoses(step);
  const v1::PoseColumns& poses = step.poses();
  ASSERT_EQ(poses.object_size(), 2);
  for (int i = 0; i < 2; ++i) {
    const dBodyID body = poses.object(i) == 4 ? right_ : left_;
    EXPECT_EQ(poses.position_m(3 * i), dBodyGetPosition(body)[0]);
    EXPECT_EQ(poses.orientation(4 * i + 3), static_cast<float>(dBodyGetQuaternion(body)[3]));
  }
}

}  // namespace
}  // namespace carillon::adapters
