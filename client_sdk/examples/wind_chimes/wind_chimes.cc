// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "client_sdk/adapters/bullet_strikes.h"
#include "client_sdk/examples/wind_chimes/gust.h"
#include "client_sdk/examples/wind_chimes/hertz.h"
#include "client_sdk/examples/wind_chimes/tubes.h"

namespace carillon::wind_chimes {
namespace {

constexpr double kSubstep_s = WindChimes::kStep_s / WindChimes::kSubsteps;

// The tubes hang on a circle, their centres at one height, each at a node of its first bending mode
// (22.4 % of the length from the end), where the thread takes the least from the sound.
constexpr double kCircleRadius_m = 0.062;
constexpr double kTubeCentre_z_m = -0.40;
constexpr double kNodeFromEnd = 0.224;

// A wooden ball between them, a little below their middles, so that modes without a motion of the
// middle sound too; below it the sail that catches the wind.
constexpr double kClapperRadius_m = 0.030;
constexpr double kClapper_z_m = -0.44;
constexpr double kClapperMass_kg = 0.050;
constexpr double kSail_z_m = -0.75;
constexpr double kSailSide_m = 0.09;
constexpr double kSailMass_kg = 0.012;
constexpr double kThreadMass_kg = 0.002;

constexpr double kAir_kg_per_m3 = 1.2;
constexpr double kDrag = 1.2;  // coefficient of a flat plate

// Of maple, across the grain, on aluminum.
constexpr double kContactModulus_pa = 1.4e9;
constexpr double kContactRadius_m = 1 / (1 / kClapperRadius_m + 1 / kOuterRadius_m);
constexpr double kTubeRestitution = 0.9;
constexpr double kClapperRestitution = 0.65;  // Bullet takes the product

double TubeMass(const Tube& tube) {
  const double inner = kOuterRadius_m - kWall_m;
  return kDensity_kg_per_m3 * std::numbers::pi * (kOuterRadius_m * kOuterRadius_m - inner * inner) *
         tube.length_m;
}

/// Of a hollow cylinder about its own axis z.
btVector3 TubeInertia(const Tube& tube) {
  const double inner = kOuterRadius_m - kWall_m;
  const double squares = kOuterRadius_m * kOuterRadius_m + inner * inner;
  const double mass = TubeMass(tube);
  const double across = mass * (3 * squares + tube.length_m * tube.length_m) / 12;
  return {across, across, mass * squares / 2};
}

/// Duration of an impact with impulse J: the speed of approach is J/(m (1 + e)).
double ContactDuration(const btCollisionObject& a, const btCollisionObject& b, double impulse) {
  const double mass =
      1 / (btRigidBody::upcast(&a)->getInvMass() + btRigidBody::upcast(&b)->getInvMass());
  const double restitution = a.getRestitution() * b.getRestitution();
  return HertzDuration(mass, kContactRadius_m, kContactModulus_pa,
                       impulse / (mass * (1 + restitution)));
}

}  // namespace

/// Owns all that Bullet only points to.
class WindChimes::World {
 public:
  explicit World(uint64_t seed)
      : gust_(seed),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
        strikes_({.duration_s = ContactDuration}) {
    world_.setGravity({0, 0, -9.81});
    world_.getSolverInfo().m_numIterations = 50;
    // Bullet's default takes the bounce from everything slower than 0.2 m/s.
    world_.getSolverInfo().m_restitutionVelocityThreshold = 0.01;
    world_.setInternalTickCallback(BeforeSubstep, this, /*isPreTick=*/true);
    world_.setInternalTickCallback(AfterSubstep, this, /*isPreTick=*/false);
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
    for (substep_ = 0; substep_ < kSubsteps; ++substep_) world_.stepSimulation(kSubstep_s, 0);
    return std::move(step_);
  }

 private:
  static void BeforeSubstep(btDynamicsWorld* world, btScalar) {
    static_cast<World*>(world->getWorldUserInfo())->BlowOnSail();
  }

  static void AfterSubstep(btDynamicsWorld* world, btScalar) {
    static_cast<World*>(world->getWorldUserInfo())->ReadStrikes();
  }

  /// F = rho/2 c A |v| v, with v the wind relative to the sail.
  void BlowOnSail() {
    const double time = step_.time_s() + substep_ * kSubstep_s;
    const Gust::Velocity wind = gust_.At(time);
    const btVector3 relative =
        btVector3(wind.x_m_per_s, wind.y_m_per_s, 0) - sail_->getLinearVelocity();
    const double area = kSailSide_m * kSailSide_m;
    sail_->applyCentralForce(relative * (kAir_kg_per_m3 / 2 * kDrag * area * relative.length()));
  }

  void ReadStrikes() { strikes_.Read(dispatcher_, substep_ * kSubstep_s, step_); }

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

  /// A thread between two points one above the other: a light rod that touches nothing, so that
  /// what hangs on it swings as a pendulum does, and turns about its upper end too.
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
    strikes_.AddObject(body, static_cast<uint32_t>(index + 1));
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
  adapters::BulletStrikes strikes_;
  btRigidBody* sail_ = nullptr;
  v1::ContactStep step_;
  uint64_t step_count_ = 0;
  int substep_ = 0;
};

WindChimes::WindChimes(uint64_t seed) : world_(std::make_unique<World>(seed)) {}
WindChimes::~WindChimes() = default;
v1::ContactStep WindChimes::Step() { return world_->Step(); }

}  // namespace carillon::wind_chimes
