// SPDX-License-Identifier: Apache-2.0
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <utility>

#include "client_sdk/adapters/bullet_contacts.h"
#include "client_sdk/examples/falls/fall.h"

namespace carillon::falls {
namespace {

btVector3 ToBullet(const Vector& v) { return {v[0], v[1], v[2]}; }

btTransform ToBullet(const Vector& position_m, const Quaternion& q) {
  return btTransform(btQuaternion(q[1], q[2], q[3], q[0]), ToBullet(position_m));
}

class BulletFall {
 public:
  BulletFall(const FallScene& scene, double step_s)
      : step_s_(step_s),
        contacts_({.roughness_depth = scene.roughness_depth,
                   .irregularity_length_m = scene.irregularity_length_m}) {
    world_.setGravity(ToBullet(scene.gravity_m_per_s2));
    uint32_t handle = 0;
    for (const Body& body : scene.bodies) Add(body, scene, ++handle);
    world_.setInternalTickCallback(
        [](btDynamicsWorld* world, btScalar) {
          auto& self = *static_cast<BulletFall*>(world->getWorldUserInfo());
          self.contacts_.Read(self.dispatcher_, self.step_);
        },
        this);
  }
  ~BulletFall() {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  BulletFall(const BulletFall&) = delete;
  BulletFall& operator=(const BulletFall&) = delete;

  v1::ContactStep Step() {
    step_ = v1::ContactStep();
    step_.set_time_s(static_cast<double>(++step_count_) * step_s_);
    world_.stepSimulation(step_s_, 0);
    contacts_.ReadPoses(step_);
    return std::move(step_);
  }

 private:
  void Add(const Body& body, const FallScene& scene, uint32_t handle) {
    const btRigidBody::btRigidBodyConstructionInfo info(
        body.mass_kg, nullptr,
        std::visit([this](const auto& shape) { return Keep(shape); }, body.shape),
        ToBullet(body.inertia_kg_m2));
    btRigidBody& made = *bodies_.emplace_back(std::make_unique<btRigidBody>(info));
    made.setWorldTransform(ToBullet(body.position_m, body.orientation));
    made.setLinearVelocity(ToBullet(body.velocity_m_per_s));
    made.setAngularVelocity(ToBullet(body.angular_velocity_rad_per_s));
    made.setActivationState(DISABLE_DEACTIVATION);
    // Bullet multiplies those of the two bodies.
    made.setFriction(std::sqrt(scene.friction));
    made.setRestitution(std::sqrt(scene.restitution));
    world_.addRigidBody(&made);
    if (!body.model.empty()) contacts_.AddObject(made, handle);
  }

  template <typename Shape>
  Shape* Keep(std::unique_ptr<Shape> shape) {
    Shape* kept = shape.get();
    shapes_.push_back(std::move(shape));
    return kept;
  }

  /// A box below z = 0, since Bullet finds one contact a step with its half spaces.
  btCollisionShape* Keep(const Plane&) {
    return Keep(std::vector<Box>{{.sides_m = {20, 20, 1}, .position_m = {0, 0, -0.5}}});
  }
  btCollisionShape* Keep(const Ball& ball) {
    return Keep(std::make_unique<btSphereShape>(ball.radius_m));
  }
  btCollisionShape* Keep(const Hull& hull) {
    auto* shape = Keep(std::make_unique<btConvexHullShape>());
    for (const Vector& corner : hull.corners_m) shape->addPoint(ToBullet(corner), false);
    shape->setMargin(1e-4);
    shape->recalcLocalAabb();
    return shape;
  }
  btCollisionShape* Keep(const std::vector<Box>& boxes) {
    auto* compound = Keep(std::make_unique<btCompoundShape>());
    for (const Box& box : boxes) {
      compound->addChildShape(ToBullet(box.position_m, box.orientation),
                              Keep(std::make_unique<btBoxShape>(ToBullet(box.sides_m) / 2)));
    }
    return compound;
  }

  const double step_s_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  adapters::BulletContacts contacts_;
  v1::ContactStep step_;
  int step_count_ = 0;
};

}  // namespace

Simulation FallInBullet(const FallScene& scene, double step_s) {
  return [fall = std::make_shared<BulletFall>(scene, step_s)] { return fall->Step(); };
}

}  // namespace carillon::falls
