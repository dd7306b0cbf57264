// SPDX-License-Identifier: Apache-2.0
#include <btBulletDynamicsCommon.h>

#include "client_sdk/adapters/bullet_contacts.h"
#include "client_sdk/examples/rough_floor/rough_floor.h"

namespace carillon::rough_floor {
namespace {

/// A shape whose origin is the centre of mass, and the moments of inertia.
class Shape {
 public:
  Shape(Scene scene, const Body& body) : sphere_(body.bowl_radius_m) {
    const auto& [x, y, z] = body.box_m;
    if (scene == Scene::kRoll) {
      btTransform middle = btTransform::getIdentity();
      middle.setOrigin({0, 0, body.bowl_radius_m / 2});
      bowl_.addChildShape(middle, &sphere_);
      used_ = &bowl_;
      inertia_ = btVector3(5.0 / 12, 5.0 / 12, 2.0 / 3) *
                 (body.mass_kg * body.bowl_radius_m * body.bowl_radius_m);
    } else {
      box_ = std::make_unique<btBoxShape>(btVector3(x, y, z) / 2);
      used_ = box_.get();
      used_->calculateLocalInertia(body.mass_kg, inertia_);
    }
  }

  btRigidBody::btRigidBodyConstructionInfo Of(double mass_kg) const {
    return {mass_kg, nullptr, used_, inertia_};
  }

 private:
  btSphereShape sphere_;
  btCompoundShape bowl_;
  std::unique_ptr<btBoxShape> box_;
  btCollisionShape* used_ = nullptr;
  btVector3 inertia_{0, 0, 0};
};

/// Tilted, the middle of its sphere one radius above the floor.
btTransform BowlPose(const Body& body) {
  btTransform pose = btTransform::getIdentity();
  pose.setRotation(btQuaternion(btVector3(0, 1, 0), kTilt_rad));
  const btVector3 middle(0, 0, body.bowl_radius_m);
  pose.setOrigin(middle - pose.getBasis() * btVector3(0, 0, body.bowl_radius_m / 2));
  return pose;
}

btTransform BoxPose(const Body& body) {
  btTransform pose = btTransform::getIdentity();
  pose.setOrigin({0, 0, body.box_m[2] / 2 + kDropHeight_m});
  return pose;
}

class World {
 public:
  World(Scene scene, const Body& body, double step_s)
      : scene_(scene),
        step_s_(step_s),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        shape_(scene, body),
        floor_(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &floor_shape_)),
        body_(shape_.Of(body.mass_kg)),
        contacts_({}) {
    world_.setGravity({0, 0, -9.81});
    floor_.setFriction(0.5);
    world_.addRigidBody(&floor_);
    body_.setWorldTransform(scene == Scene::kRoll ? BowlPose(body) : BoxPose(body));
    body_.setActivationState(DISABLE_DEACTIVATION);
    body_.setFriction(0.5);
    body_.setRestitution(0.3);
    if (scene == Scene::kRoll) body_.setAngularVelocity({0, 0, kRollSpin_rad_per_s});
    world_.addRigidBody(&body_);
    contacts_.AddObject(body_, 1);
    world_.setInternalTickCallback(
        [](btDynamicsWorld* world, btScalar) {
          auto& self = *static_cast<World*>(world->getWorldUserInfo());
          self.contacts_.Read(self.dispatcher_, self.step_);
        },
        this);
  }
  ~World() {
    world_.removeRigidBody(&body_);
    world_.removeRigidBody(&floor_);
  }

  v1::ContactStep Step() {
    step_ = v1::ContactStep();
    const double time_s = static_cast<double>(++step_count_) * step_s_;
    step_.set_time_s(time_s);
    if (scene_ == Scene::kDrag && time_s > kDragStart_s && time_s < kDragEnd_s) {
      body_.setLinearVelocity({kDragSpeed_m_per_s, 0, body_.getLinearVelocity().z()});
    }
    world_.stepSimulation(step_s_, 0);
    return std::move(step_);
  }

 private:
  const Scene scene_;
  const double step_s_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  btStaticPlaneShape floor_shape_{{0, 0, 1}, 0};
  Shape shape_;
  btRigidBody floor_, body_;
  adapters::BulletContacts contacts_;
  v1::ContactStep step_;
  int step_count_ = 0;
};

}  // namespace

Simulation SimulateInBullet(Scene scene, const Body& body, double step_s) {
  return [world = std::make_shared<World>(scene, body, step_s)] { return world->Step(); };
}

}  // namespace carillon::rough_floor
