// SPDX-License-Identifier: Apache-2.0
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <utility>
#include <vector>

#include "client_sdk/adapters/bullet_contacts.h"
#include "client_sdk/examples/wind_chimes/gust.h"
#include "client_sdk/examples/wind_chimes/hanging.h"
#include "client_sdk/examples/wind_chimes/tubes.h"
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

namespace carillon::wind_chimes {
namespace {

btVector3 ToBullet(const Vector& v) { return {v[0], v[1], v[2]}; }

/// Owns the objects to which Bullet only points.
class BulletChimes {
 public:
  BulletChimes(uint64_t seed, Purpose purpose)
      : purpose_(purpose),
        gust_(seed),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        contacts_({.roughness_depth = 0, .striker = "wood"}) {
    world_.setGravity({0, 0, -9.81});
    world_.getSolverInfo().m_numIterations = 50;
    // By default Bullet lets no contact bounce that is slower than 0.2 m/s.
    world_.getSolverInfo().m_restitutionVelocityThreshold = kSlowest_m_per_s;
    world_.setInternalTickCallback(BeforeStep, this, /*isPreTick=*/true);
    world_.setInternalTickCallback(AfterStep, this, /*isPreTick=*/false);
    for (size_t i = 0; i < kTubes.size(); ++i) HangTube(i);
    HangClapper();
    if (purpose == Purpose::kSound) return;
    contacts_.AddObject(*clapper_, kClapperHandle);
    contacts_.AddObject(*sail_, kSailHandle);
  }

  ~BulletChimes() {
    for (const auto& constraint : constraints_) world_.removeConstraint(constraint.get());
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  v1::ContactStep Step() {
    step_ = v1::ContactStep();
    step_.set_time_s(static_cast<double>(step_count_++) * kStep_s);
    world_.stepSimulation(kStep_s, 0);
    if (purpose_ == Purpose::kPicture) contacts_.ReadPoses(step_);
    for (v1::Contact& contact : *step_.mutable_contacts()) {
      if (!contact.has_second()) contact.mutable_hertz()->set_striker_radius_m(kClapperRadius_m);
    }
    return std::move(step_);
  }

 private:
  static void BeforeStep(btDynamicsWorld* world, btScalar) {
    static_cast<BulletChimes*>(world->getWorldUserInfo())->BlowOnSail();
  }

  static void AfterStep(btDynamicsWorld* world, btScalar) {
    static_cast<BulletChimes*>(world->getWorldUserInfo())->ReadContacts();
  }

  void BlowOnSail() {
    const btVector3& velocity = sail_->getLinearVelocity();
    const Vector sail{velocity.x(), velocity.y(), velocity.z()};
    sail_->applyCentralForce(ToBullet(DragOnSail(gust_.At(step_.time_s()), sail)));
  }

  void ReadContacts() { contacts_.Read(dispatcher_, step_); }

  btRigidBody& AddBody(std::unique_ptr<btCollisionShape> shape, double mass,
                       const btVector3& inertia, const btVector3& centre, bool collides) {
    btTransform pose = btTransform::getIdentity();
    pose.setOrigin(centre);
    auto& body = *bodies_.emplace_back(std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(mass, nullptr, shape.get(), inertia)));
    shapes_.push_back(std::move(shape));
    body.setWorldTransform(pose);
    body.setDamping(kLinearDamping, kAngularDamping);
    body.setActivationState(DISABLE_DEACTIVATION);
    const int solid = btBroadphaseProxy::DefaultFilter, nothing = 0;
    world_.addRigidBody(&body, solid, collides ? solid : nothing);
    return body;
  }

  btRigidBody& AddSolid(std::unique_ptr<btCollisionShape> shape, double mass,
                        const btVector3& centre, bool collides) {
    btVector3 inertia;
    shape->calculateLocalInertia(mass, inertia);
    return AddBody(std::move(shape), mass, inertia, centre, collides);
  }

  /// Joins `body` to the world, or to another body, at a point given in the world.
  void Pin(btRigidBody& body, const btVector3& point) {
    AddConstraint(std::make_unique<btPoint2PointConstraint>(body, ToLocal(body, point)));
  }
  void Pin(btRigidBody& body, btRigidBody& other, const btVector3& point) {
    AddConstraint(std::make_unique<btPoint2PointConstraint>(body, other, ToLocal(body, point),
                                                            ToLocal(other, point)));
  }

  static btVector3 ToLocal(const btRigidBody& body, const btVector3& point) {
    return body.getWorldTransform().inverse() * point;
  }

  void AddConstraint(std::unique_ptr<btTypedConstraint> constraint) {
    world_.addConstraint(constraint.get(), /*disableCollisionsBetweenLinkedBodies=*/true);
    constraints_.push_back(std::move(constraint));
  }

  /// Adds a thread between two points, one above the other. It is a light rod that touches nothing;
  /// a body that hangs on it swings as a double pendulum.
  btRigidBody& AddThread(const btVector3& top, const btVector3& bottom) {
    const double length = (top - bottom).length();
    return AddSolid(std::make_unique<btCapsuleShapeZ>(kThreadRadius_m, length), kThreadMass_kg,
                    (top + bottom) / 2, /*collides=*/false);
  }

  void HangTube(size_t index) {
    const Tube& tube = kTubes[index];
    const btVector3 axis = ToBullet(TopOf(index));
    const btVector3 centre = axis + btVector3(0, 0, kTubeCentre_z_m);
    const btVector3 node = centre + btVector3(0, 0, (0.5 - kNodeFromEnd) * tube.length_m);
    auto shape = std::make_unique<btCylinderShapeZ>(
        btVector3(kOuterRadius_m, kOuterRadius_m, tube.length_m / 2));
    shape->setMargin(0.001);
    btRigidBody& body =
        AddBody(std::move(shape), MassOf(tube), ToBullet(InertiaOf(tube)), centre, true);
    body.setRestitution(kTubeRestitution);
    contacts_.AddObject(body, static_cast<uint32_t>(index + 1));
    btRigidBody& thread = AddThread(axis, node);
    Pin(thread, axis);
    Pin(thread, body, node);
  }

  void HangClapper() {
    const btVector3 top(0, 0, 0), middle(0, 0, kClapper_z_m), bottom(0, 0, kSail_z_m);
    btRigidBody& clapper =
        AddSolid(std::make_unique<btSphereShape>(kClapperRadius_m), kClapperMass_kg, middle, true);
    clapper.setRestitution(kClapperRestitution);
    clapper_ = &clapper;
    sail_ = &AddSolid(std::make_unique<btBoxShape>(btVector3(kSailSide_m, 0.001, kSailSide_m) / 2),
                      kSailMass_kg, bottom, false);
    btRigidBody& upper = AddThread(top, middle);
    btRigidBody& lower = AddThread(middle, bottom);
    Pin(upper, top);
    Pin(upper, clapper, middle);
    Pin(lower, clapper, middle);
    Pin(lower, *sail_, bottom);
  }

  const Purpose purpose_;
  Gust gust_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<std::unique_ptr<btTypedConstraint>> constraints_;
  adapters::BulletContacts contacts_;
  btRigidBody* clapper_ = nullptr;
  btRigidBody* sail_ = nullptr;
  v1::ContactStep step_;
  uint64_t step_count_ = 0;
};

}  // namespace

Simulation Chimes(uint64_t seed, Purpose purpose) {
  return [chimes = std::make_shared<BulletChimes>(seed, purpose)] { return chimes->Step(); };
}

}  // namespace carillon::wind_chimes
