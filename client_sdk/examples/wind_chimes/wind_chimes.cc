// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "client_sdk/adapters/bullet_contacts.h"
#include "client_sdk/examples/wind_chimes/gust.h"
#include "client_sdk/examples/wind_chimes/tubes.h"

namespace carillon::wind_chimes {
namespace {

// The tubes hang on a circle, with their centres at one height. A thread holds each tube at a node
// of its first bending mode (22.4 % of the length from the end), where it damps the sound least.
constexpr double kCircleRadius_m = 0.062;
constexpr double kTubeCentre_z_m = -0.40;
constexpr double kNodeFromEnd = 0.224;

// The clapper is a wooden ball between the tubes. It hangs a little below their middles, so that it
// also excites modes that have a node there. Below the clapper hangs the sail that catches the
// wind.
constexpr double kClapperRadius_m = 0.030;
constexpr double kClapper_z_m = -0.44;
constexpr double kClapperMass_kg = 0.050;
constexpr double kSail_z_m = -0.75;
constexpr double kSailSide_m = 0.09;
constexpr double kSailMass_kg = 0.012;
constexpr double kThreadMass_kg = 0.002;

constexpr double kAir_kg_per_m3 = 1.2;
constexpr double kDrag = 1.2;  // coefficient of a flat plate

constexpr double kTubeRestitution = 0.9;
constexpr double kClapperRestitution = 0.65;  // Bullet takes the product

double TubeMass(const Tube& tube) {
  const double inner = kOuterRadius_m - kWall_m;
  return kDensity_kg_per_m3 * std::numbers::pi * (kOuterRadius_m * kOuterRadius_m - inner * inner) *
         tube.length_m;
}

/// The moments of inertia of a hollow cylinder with the axis z.
btVector3 TubeInertia(const Tube& tube) {
  const double inner = kOuterRadius_m - kWall_m;
  const double squares = kOuterRadius_m * kOuterRadius_m + inner * inner;
  const double mass = TubeMass(tube);
  const double across = mass * (3 * squares + tube.length_m * tube.length_m) / 12;
  return {across, across, mass * squares / 2};
}

}  // namespace

/// Owns the objects to which Bullet only points.
class WindChimes::World {
 public:
  explicit World(uint64_t seed)
      : gust_(seed),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        contacts_({.roughness_depth = 0, .striker = "wood"}) {
    world_.setGravity({0, 0, -9.81});
    world_.getSolverInfo().m_numIterations = 50;
    // By default Bullet lets no contact bounce that is slower than 0.2 m/s.
    world_.getSolverInfo().m_restitutionVelocityThreshold = 0.01;
    world_.setInternalTickCallback(BeforeStep, this, /*isPreTick=*/true);
    world_.setInternalTickCallback(AfterStep, this, /*isPreTick=*/false);
    for (size_t i = 0; i < kTubes.size(); ++i) HangTube(i);
    HangClapper();
  }

  ~World() {
    for (const auto& constraint : constraints_) world_.removeConstraint(constraint.get());
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  v1::ContactStep Step() {
    step_ = v1::ContactStep();
    step_.set_time_s(static_cast<double>(step_count_++) * kStep_s);
    world_.stepSimulation(kStep_s, 0);
    for (v1::EngineContact& contact : *step_.mutable_contacts()) {
      if (!contact.has_second()) contact.mutable_hertz()->set_striker_radius_m(kClapperRadius_m);
    }
    return std::move(step_);
  }

 private:
  static void BeforeStep(btDynamicsWorld* world, btScalar) {
    static_cast<World*>(world->getWorldUserInfo())->BlowOnSail();
  }

  static void AfterStep(btDynamicsWorld* world, btScalar) {
    static_cast<World*>(world->getWorldUserInfo())->ReadContacts();
  }

  /// Applies the drag F = rho/2 c A |v| v, where v is the velocity of the wind relative to the
  /// sail.
  void BlowOnSail() {
    const Gust::Velocity wind = gust_.At(step_.time_s());
    const btVector3 relative =
        btVector3(wind.x_m_per_s, wind.y_m_per_s, 0) - sail_->getLinearVelocity();
    const double area = kSailSide_m * kSailSide_m;
    sail_->applyCentralForce(relative * (kAir_kg_per_m3 / 2 * kDrag * area * relative.length()));
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
    body.setDamping(0.02, 0.05);
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
    return AddSolid(std::make_unique<btCapsuleShapeZ>(0.002, length), kThreadMass_kg,
                    (top + bottom) / 2, /*collides=*/false);
  }

  void HangTube(size_t index) {
    const Tube& tube = kTubes[index];
    const double angle = 2 * std::numbers::pi * static_cast<double>(index) / kTubes.size();
    const btVector3 axis(kCircleRadius_m * std::cos(angle), kCircleRadius_m * std::sin(angle), 0);
    const btVector3 centre = axis + btVector3(0, 0, kTubeCentre_z_m);
    const btVector3 node = centre + btVector3(0, 0, (0.5 - kNodeFromEnd) * tube.length_m);
    auto shape = std::make_unique<btCylinderShapeZ>(
        btVector3(kOuterRadius_m, kOuterRadius_m, tube.length_m / 2));
    shape->setMargin(0.001);
    btRigidBody& body = AddBody(std::move(shape), TubeMass(tube), TubeInertia(tube), centre, true);
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
    sail_ = &AddSolid(std::make_unique<btBoxShape>(btVector3(kSailSide_m, 0.001, kSailSide_m) / 2),
                      kSailMass_kg, bottom, false);
    btRigidBody& upper = AddThread(top, middle);
    btRigidBody& lower = AddThread(middle, bottom);
    Pin(upper, top);
    Pin(upper, clapper, middle);
    Pin(lower, clapper, middle);
    Pin(lower, *sail_, bottom);
  }

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
  btRigidBody* sail_ = nullptr;
  v1::ContactStep step_;
  uint64_t step_count_ = 0;
};

WindChimes::WindChimes(uint64_t seed) : world_(std::make_unique<World>(seed)) {}
WindChimes::~WindChimes() = default;
v1::ContactStep WindChimes::Step() { return world_->Step(); }

}  // namespace carillon::wind_chimes
