// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/bullet_strikes.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace carillon::adapters {
namespace {

constexpr double kSubstep_s = 1.0 / 960;
constexpr uint32_t kBall = 7, kOther = 8;

/// A world without gravity, read out after every substep.
class BulletStrikesTest : public testing::Test {
 protected:
  BulletStrikesTest()
      : dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        strikes_({.duration_s = [](const auto&, const auto&, double) { return 0.0003; }}) {
    world_.setGravity({0, 0, 0});
    world_.setInternalTickCallback(
        [](btDynamicsWorld* world, btScalar) {
          auto& test = *static_cast<BulletStrikesTest*>(world->getWorldUserInfo());
          test.strikes_.Read(test.dispatcher_, 0, test.step_);
        },
        this);
  }

  void TearDown() override {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  btRigidBody& AddBall(double mass, const btVector3& centre, const btVector3& velocity) {
    return Add(std::make_unique<btSphereShape>(0.05), mass, centre, velocity);
  }

  btRigidBody& AddFloor() {
    return Add(std::make_unique<btBoxShape>(btVector3(1, 1, 0.5)), 0, {0, 0, -0.5}, {0, 0, 0});
  }

  btRigidBody& Add(std::unique_ptr<btCollisionShape> shape, double mass, const btVector3& centre,
                   const btVector3& velocity) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    auto& body = *bodies_.emplace_back(std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(mass, nullptr, shape.get(), inertia)));
    shapes_.push_back(std::move(shape));
    btTransform pose = btTransform::getIdentity();
    pose.setOrigin(centre);
    body.setWorldTransform(pose);
    body.setLinearVelocity(velocity);
    body.setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(&body);
    return body;
  }

  void Simulate(double seconds) {
    for (int i = 0; i < seconds / kSubstep_s; ++i) world_.stepSimulation(kSubstep_s, 0);
  }

  /// Sum of the strikes so far on one object, in its own frame.
  btVector3 TotalImpulse(uint32_t object) const {
    btVector3 sum(0, 0, 0);
    for (const v1::Impulse& strike : step_.impulses()) {
      if (strike.object() != object) continue;
      const v1::Vec3& impulse = strike.impulse_newton_seconds();
      sum += btVector3(impulse.x(), impulse.y(), impulse.z());
    }
    return sum;
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  BulletStrikes strikes_;
  v1::ContactStep step_;
};

void ExpectNear(const btVector3& a, const btVector3& b, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
}

TEST_F(BulletStrikesTest, StrikesOfACollisionAreTheChangeOfMomentumOfBothBodies) {
  // Off centre, so that friction takes part.
  btRigidBody& ball = AddBall(0.2, {0, 0, 0}, {1, 0, 0});
  btRigidBody& other = AddBall(0.3, {0.2, 0.03, 0}, {0, 0, 0});
  // Turned bodies, so that world and body frames differ; balls, so that nothing else does.
  ball.getWorldTransform().setRotation({btVector3(0, 0, 1), 0.7});
  other.getWorldTransform().setRotation({btVector3(1, 1, 0), 1.9});
  for (btRigidBody* body : {&ball, &other}) body->setRestitution(0.8);
  strikes_.AddObject(ball, kBall);
  strikes_.AddObject(other, kOther);
  Simulate(0.3);
  ASSERT_GT(step_.impulses_size(), 0);
  const btVector3 on_ball = (ball.getLinearVelocity() - btVector3(1, 0, 0)) * 0.2;
  const btVector3 on_other = other.getLinearVelocity() * 0.3;
  ASSERT_GT(on_other.length(), 0.01);
  ASSERT_GT(std::abs(on_other.y()), 0.001);
  // Lengths, because friction has turned the bodies' frames since; the next test has a direction.
  EXPECT_NEAR(TotalImpulse(kBall).length(), on_ball.length(), 1e-9);
  EXPECT_NEAR(TotalImpulse(kOther).length(), on_other.length(), 1e-9);
}

TEST_F(BulletStrikesTest, StrikeIsAtTheTouchedPointInTheFrameOfTheBody) {
  AddFloor();
  btRigidBody& ball = AddBall(0.2, {0, 0, 0.06}, {0, 0, -1});
  const btQuaternion turned(btVector3(1, 0, 0), 1.0);
  ball.getWorldTransform().setRotation(turned);
  strikes_.AddObject(ball, kBall);
  Simulate(0.05);
  ASSERT_GE(step_.impulses_size(), 1);
  const v1::Impulse& strike = step_.impulses(0);
  EXPECT_EQ(strike.object(), kBall);
  EXPECT_EQ(strike.duration_s(), 0.0003);
  const btVector3 point(strike.point_m().x(), strike.point_m().y(), strike.point_m().z());
  // The ball stays where it lands, whole impulse spent. Rounding only: it moves straight down.
  ExpectNear(quatRotate(turned, point), {0, 0, -0.05}, 1e-6);
  ExpectNear(quatRotate(turned, TotalImpulse(kBall)), {0, 0, 0.2}, 1e-6);
}

TEST_F(BulletStrikesTest, RestingLoadIsNotHeard) {
  world_.setGravity({0, 0, -9.81});
  AddFloor();
  btRigidBody& box =
      Add(std::make_unique<btBoxShape>(btVector3(0.1, 0.1, 0.1)), 0.5, {0, 0, 0.15}, {0, 0, 0});
  strikes_.AddObject(box, kOther);
  Simulate(1);
  EXPECT_GT(step_.impulses_size(), 0);
  // It fell 5 cm: v = sqrt(2 g h).
  EXPECT_GT(TotalImpulse(kOther).length(), 0.5 * std::sqrt(2 * 9.81 * 0.05) * 0.9);
  step_.Clear();
  Simulate(2);
  EXPECT_EQ(step_.impulses_size(), 0);
}

TEST_F(BulletStrikesTest, BodiesNobodyHearsSendNothing) {
  AddBall(0.2, {0, 0, 0}, {1, 0, 0});
  AddBall(0.3, {0.2, 0, 0}, {0, 0, 0});
  Simulate(0.3);
  EXPECT_EQ(step_.impulses_size(), 0);
}

}  // namespace
}  // namespace carillon::adapters
