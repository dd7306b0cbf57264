// SPDX-License-Identifier: Apache-2.0
//
// The adapters in C++, each with its engine: two balls of 1 kg meet without weight. The left one
// flies to the right at 1 m/s. The right one is turned by a quarter about z, so that the world's x
// axis is the -y axis of its frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "client_sdk/adapters/bullet_contacts.h"
#include "client_sdk/adapters/mujoco_contacts.h"
#include "client_sdk/adapters/ode_contacts.h"

namespace carillon::adapters {
namespace {

constexpr double kRadiusM = 0.05, kStepS = 0.001, kRightM = 2 * kRadiusM + 0.001;
constexpr uint32_t kRight = 4, kLeft = 9;  // handles

/// Where a ball was when its pose was taken, and how fast it flies now.
struct Ball {
  double x_m = 0, x_m_per_s = 0, quaternion_z = 0;
};

/// Balls with friction, read out after every substep.
class BulletBalls {
 public:
  static constexpr double kRounding = 1e-6, kDepthM = 0.002, kLeastNewtonSeconds = 0.4;

  BulletBalls() : dispatcher_(&configuration_) {
    world_.setGravity({0, 0, 0});
    world_.setInternalTickCallback(
        [](btDynamicsWorld* world, btScalar) {
          auto& balls = *static_cast<BulletBalls*>(world->getWorldUserInfo());
          balls.contacts.Read(balls.dispatcher_, balls.step);
        },
        this);
    for (btRigidBody* body : {&left, &right}) world_.addRigidBody(body);
    left.setLinearVelocity({1, 0, 0});
    const btQuaternion quarter({0, 0, 1}, std::numbers::pi_v<btScalar> / 2);
    right.setWorldTransform(btTransform(quarter, {kRightM, 0, 0}));
  }
  BulletBalls(const BulletBalls&) = delete;
  BulletBalls& operator=(const BulletBalls&) = delete;
  ~BulletBalls() {
    for (btRigidBody* body : {&left, &right}) world_.removeRigidBody(body);
  }

  void Hear(uint32_t handle) { contacts.AddObject(BodyOf(handle), handle); }
  void Remove(uint32_t handle) { contacts.RemoveObject(BodyOf(handle)); }
  void Step() { world_.stepSimulation(kStepS, 0); }
  void ReadPoses(v1::ContactStep& poses) const { contacts.ReadPoses(poses); }
  Ball Find(uint32_t handle) {
    const btRigidBody& body = BodyOf(handle);
    const btTransform& place = body.getWorldTransform();
    return {place.getOrigin().x(), body.getLinearVelocity().x(), place.getRotation().z()};
  }

  btSphereShape ball{kRadiusM};
  btRigidBody left{{1, nullptr, &ball, {1, 1, 1}}}, right{{1, nullptr, &ball, {1, 1, 1}}};
  BulletContacts contacts{{}};
  v1::ContactStep step;

 private:
  btRigidBody& BodyOf(uint32_t handle) { return handle == kLeft ? left : right; }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
};

/// Balls without friction.
class OdeBalls {
 public:
  static constexpr double kRounding = 1e-12, kDepthM = 0.002, kLeastNewtonSeconds = 0.5;

  /// `swapped`: how the joints order their bodies.
  explicit OdeBalls(bool swapped = false) : swapped_(swapped) {
    dBodySetLinearVel(left_, 1, 0, 0);
    dBodySetPosition(right_, kRightM, 0, 0);
    const dQuaternion quarter{std::numbers::sqrt2 / 2, 0, 0, std::numbers::sqrt2 / 2};
    dBodySetQuaternion(right_, quarter);
  }
  OdeBalls(const OdeBalls&) = delete;
  OdeBalls& operator=(const OdeBalls&) = delete;
  ~OdeBalls() {
    dJointGroupDestroy(joints_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }

  void Hear(uint32_t handle) { contacts_.AddObject(BodyOf(handle), handle); }
  void Remove(uint32_t handle) { contacts_.RemoveObject(BodyOf(handle)); }
  /// A wall at `x`, which belongs to no body.
  void AddWall(double x) { dCreatePlane(space_, -1, 0, 0, -x); }
  void Step() {
    dSpaceCollide(space_, this, [](void* balls, dGeomID a, dGeomID b) {
      static_cast<OdeBalls*>(balls)->Meet(a, b);
    });
    dWorldStep(world_, kStepS);
    contacts_.Read(kStepS, step);
    dJointGroupEmpty(joints_);
  }
  void ReadPoses(v1::ContactStep& poses) const { contacts_.ReadPoses(poses); }
  Ball Find(uint32_t handle) const {
    const dBodyID body = BodyOf(handle);
    return {dBodyGetPosition(body)[0], dBodyGetLinearVel(body)[0], dBodyGetQuaternion(body)[3]};
  }

  v1::ContactStep step;

 private:
  /// ODE's own state lasts as long as its world.
  struct Library {
    Library() { dInitODE2(0); }
    ~Library() { dCloseODE(); }
  };

  dBodyID BodyOf(uint32_t handle) const { return handle == kLeft ? left_ : right_; }

  dBodyID AddBall() {
    dBodyID body = dBodyCreate(world_);
    dMass mass;
    dMassSetSphereTotal(&mass, 1, kRadiusM);
    dBodySetMass(body, &mass);
    dGeomSetBody(dCreateSphere(space_, kRadiusM), body);
    return body;
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

  Library library_;
  dWorldID world_ = dWorldCreate();
  dSpaceID space_ = dSimpleSpaceCreate(nullptr);
  dJointGroupID joints_ = dJointGroupCreate(0);
  bool swapped_;
  dBodyID left_ = AddBall(), right_ = AddBall();
  OdeContacts contacts_{{}};
};

class SwappedOdeBalls : public OdeBalls {
 public:
  SwappedOdeBalls() : OdeBalls(true) {}
};

/// Balls without friction, whose soft contact lasts for several steps.
class MujocoBalls {
 public:
  static constexpr double kRounding = 1e-6, kDepthM = 0.001, kLeastNewtonSeconds = 0.4;

  MujocoBalls() { data_->qvel[0] = 1; }
  MujocoBalls(const MujocoBalls&) = delete;
  MujocoBalls& operator=(const MujocoBalls&) = delete;
  ~MujocoBalls() {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

  void Hear(uint32_t handle) { contacts_.AddObject(BodyOf(handle), handle); }
  void Remove(uint32_t handle) { contacts_.RemoveObject(BodyOf(handle)); }
  void Step() {
    for (const uint32_t handle : {kLeft, kRight}) {
      const mjtNum* place = data_->qpos + 7 * (BodyOf(handle) - 1);
      (handle == kLeft ? left_ : right_) = {.x_m = place[0], .quaternion_z = place[6]};
    }
    mj_step(model_, data_);
    contacts_.Read(*data_, step);
  }
  void ReadPoses(v1::ContactStep& poses) const { contacts_.ReadPoses(*data_, poses); }
  Ball Find(uint32_t handle) const {
    Ball ball = handle == kLeft ? left_ : right_;
    ball.x_m_per_s = data_->qvel[6 * (BodyOf(handle) - 1)];
    return ball;
  }

  v1::ContactStep step;

 private:
  static int BodyOf(uint32_t handle) { return handle == kLeft ? 1 : 2; }

  static mjModel* Load(const std::string& xml) {
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

  mjModel* model_ = Load(
      "<mujoco><option timestep='0.001' gravity='0 0 0'/>"
      "<default><geom type='sphere' size='0.05' mass='1' friction='0 0 0'/></default><worldbody>"
      "<body><freejoint/><geom/></body>"
      "<body pos='0.101 0 0' quat='0.70710678 0 0 0.70710678'><freejoint/><geom/></body>"
      "</worldbody></mujoco>");
  mjData* data_ = mj_makeData(model_);
  MujocoContacts contacts_{{}, *model_};
  Ball left_, right_;  ///< where they were when the step began
};

template <class Balls>
class TwoBalls : public testing::Test {
 protected:
  void Hear() {
    for (const uint32_t handle : {kRight, kLeft}) balls_.Hear(handle);
  }
  void Simulate() {
    for (int i = 0; i < 200; ++i) balls_.Step();
  }

  Balls balls_;
};

using AllBalls = testing::Types<BulletBalls, OdeBalls, SwappedOdeBalls, MujocoBalls>;
TYPED_TEST_SUITE(TwoBalls, AllBalls);

TYPED_TEST(TwoBalls, AreNotReadIfTheyAreNotHeard) {
  this->Simulate();
  EXPECT_EQ(this->balls_.step.contacts_size(), 0);
  EXPECT_GT(this->balls_.Find(kRight).x_m_per_s, 0);  // they have met
}

TYPED_TEST(TwoBalls, GiveRowsWithASecondObjectThatAddUpToTheChangeOfMomentumOfBoth) {
  this->Hear();
  this->Simulate();
  const v1::ContactStep& step = this->balls_.step;
  ASSERT_GT(step.contacts_size(), 0);
  double sum = 0;
  for (const v1::Contact& contact : step.contacts()) {
    EXPECT_EQ(contact.object(), kRight);
    EXPECT_EQ(contact.second().object(), kLeft);
    EXPECT_EQ(contact.partner(), step.contacts(0).partner());
    EXPECT_NEAR(contact.impulse_newton_seconds().x(), 0, TypeParam::kRounding);
    EXPECT_NEAR(std::abs(contact.normal().y()), 1, TypeParam::kRounding);
    sum -= contact.impulse_newton_seconds().y();
  }
  EXPECT_GT(sum, TypeParam::kLeastNewtonSeconds);
  const double rounding = std::max(TypeParam::kRounding, 1e-9);
  EXPECT_NEAR(sum, this->balls_.Find(kRight).x_m_per_s, rounding);
  EXPECT_NEAR(-sum, this->balls_.Find(kLeft).x_m_per_s - 1, rounding);
  const v1::Contact& contact = step.contacts(0);
  // As deep as they are in one another.
  EXPECT_NEAR(contact.point_m().y(), kRadiusM, TypeParam::kDepthM);
  EXPECT_NEAR(contact.second().point_m().x(), kRadiusM, TypeParam::kDepthM);
  // Back from the turned frame: -y is x again.
  EXPECT_NEAR(contact.second().rotation().w(), std::numbers::sqrt2 / 2, TypeParam::kRounding);
  EXPECT_NEAR(contact.second().rotation().z(), std::numbers::sqrt2 / 2, TypeParam::kRounding);
}

TYPED_TEST(TwoBalls, HaveNoSecondObjectWhereOneIsNotHeardOrWasRemoved) {
  this->Hear();
  this->balls_.Remove(kRight);
  this->Simulate();
  double sum = 0;
  for (const v1::Contact& contact : this->balls_.step.contacts()) {
    EXPECT_EQ(contact.object(), kLeft);
    EXPECT_FALSE(contact.has_second());
    EXPECT_EQ(contact.hertz().striker_mass_kg(), 1);
    sum += contact.impulse_newton_seconds().x();
  }
  EXPECT_LT(sum, -TypeParam::kLeastNewtonSeconds);
  v1::ContactStep step;
  this->balls_.ReadPoses(step);
  EXPECT_EQ(step.poses().object_size(), 1);
}

TYPED_TEST(TwoBalls, HaveThePosesOfTheBodies) {
  this->Hear();
  this->Simulate();
  v1::ContactStep step;
  this->balls_.ReadPoses(step);
  const v1::PoseColumns& poses = step.poses();
  ASSERT_EQ(poses.object_size(), 2);
  for (int i = 0; i < 2; ++i) {
    const Ball ball = this->balls_.Find(poses.object(i));
    EXPECT_EQ(poses.position_m(3 * i), ball.x_m);
    EXPECT_EQ(poses.orientation(4 * i + 3), static_cast<float>(ball.quaternion_z));
  }
}

TEST(BulletContacts, GivesImpulsesWithFrictionInTheFrameOfTheBody) {
  BulletBalls balls;
  balls.Hear(kLeft);
  // Off centre, so that friction takes part; turned, so that the frames of body and world differ.
  balls.right.getWorldTransform().setOrigin({0.097F, 0.03F, 0});
  balls.left.getWorldTransform().setRotation({btVector3(1, 2, 3), 0.7F});
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < 10; ++i) {
    balls.step.Clear();
    balls.Step();
    for (const v1::Contact& contact : balls.step.contacts()) {
      EXPECT_FALSE(contact.has_second());
      const v1::Vec3& impulse = contact.impulse_newton_seconds();
      sum += balls.left.getWorldTransform().getBasis() *
             btVector3(impulse.x(), impulse.y(), impulse.z());
    }
  }
  const btVector3 change = balls.left.getLinearVelocity() - btVector3(1, 0, 0);  // of 1 kg
  ASSERT_LT(change.x(), -0.1);
  ASSERT_GT(std::abs(change.y()), 0.01);
  EXPECT_LT((sum - change).length(), 1e-9);
}

TEST(OdeContacts, AWallThatIsNoBodyIsNoSecondObject) {
  for (const bool swapped : {false, true}) {
    OdeBalls balls(swapped);
    for (const uint32_t handle : {kRight, kLeft}) balls.Hear(handle);
    balls.AddWall(kRightM + kRadiusM - 0.0005);  // the right ball touches it
    for (int i = 0; i < 20; ++i) balls.Step();
    double sum = 0;
    for (const v1::Contact& contact : balls.step.contacts()) {
      if (contact.has_second()) continue;
      EXPECT_EQ(contact.object(), kRight);
      sum -= contact.impulse_newton_seconds().y();
    }
    // All that the two have lost together.
    EXPECT_LT(sum, -0.05);
    EXPECT_NEAR(sum, balls.Find(kLeft).x_m_per_s + balls.Find(kRight).x_m_per_s - 1, 1e-9);
  }
}

}  // namespace
}  // namespace carillon::adapters
