// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <memory>

#include "client_sdk/examples/ode_world.h"
#include "client_sdk/examples/wind_chimes/gust.h"
#include "client_sdk/examples/wind_chimes/hanging.h"
#include "client_sdk/examples/wind_chimes/tubes.h"
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

namespace carillon::wind_chimes {
namespace {

class OdeChimes {
 public:
  OdeChimes(uint64_t seed, Purpose purpose) : purpose_(purpose), gust_(seed) {
    const dWorldID world = world_.world();
    dWorldSetGravity(world, 0, 0, -9.81);
    // ODE takes a share of the velocity in each step.
    dWorldSetLinearDamping(world, kLinearDamping * kStep_s);
    dWorldSetAngularDamping(world, kAngularDamping * kStep_s);
    dWorldSetLinearDampingThreshold(world, 0);
    dWorldSetAngularDampingThreshold(world, 0);
    for (size_t i = 0; i < kTubes.size(); ++i) HangTube(i);
    HangClapper();
    if (purpose == Purpose::kSound) return;
    world_.contacts().AddObject(clapper_, kClapperHandle);
    world_.contacts().AddObject(sail_, kSailHandle);
  }

  v1::ContactStep Step() {
    const double time_s = static_cast<double>(step_count_++) * kStep_s;
    BlowOnSail(time_s);
    v1::ContactStep step = world_.Step(time_s);
    if (purpose_ == Purpose::kPicture) world_.contacts().ReadPoses(step);
    for (v1::Contact& contact : *step.mutable_contacts()) {
      if (!contact.has_second()) contact.mutable_hertz()->set_striker_radius_m(kClapperRadius_m);
    }
    return step;
  }

 private:
  void BlowOnSail(double time_s) {
    const dReal* velocity = dBodyGetLinearVel(sail_);
    const auto [x, y, z] = DragOnSail(gust_.At(time_s), {velocity[0], velocity[1], velocity[2]});
    dBodyAddForce(sail_, x, y, z);
  }

  dBodyID AddBody(const dMass& mass, const Vector& centre) {
    const dBodyID body = dBodyCreate(world_.world());
    dBodySetMass(body, &mass);
    dBodySetPosition(body, centre[0], centre[1], centre[2]);
    return body;
  }

  /// Joins two bodies, or one to the world if `other` is null, at a point given in the world.
  void Pin(dBodyID body, dBodyID other, const Vector& point) {
    const dJointID joint = dJointCreateBall(world_.world(), nullptr);
    dJointAttach(joint, body, other);
    dJointSetBallAnchor(joint, point[0], point[1], point[2]);
  }

  /// Adds a thread between two points, one above the other. It is a light rod that touches nothing;
  /// a body that hangs on it swings as a double pendulum.
  dBodyID AddThread(const Vector& top, const Vector& bottom) {
    dMass mass;
    dMassSetCylinderTotal(&mass, kThreadMass_kg, 3, kThreadRadius_m, top[2] - bottom[2]);
    return AddBody(mass, {top[0], top[1], (top[2] + bottom[2]) / 2});
  }

  /// The tube is a capsule, whose round ends nothing reaches: ODE lets no two cylinders meet.
  void HangTube(size_t index) {
    const Tube& tube = kTubes[index];
    const Vector top = TopOf(index);
    const Vector node{top[0], top[1], kTubeCentre_z_m + (0.5 - kNodeFromEnd) * tube.length_m};
    const auto [x, y, z] = InertiaOf(tube);
    dMass mass;
    dMassSetParameters(&mass, MassOf(tube), 0, 0, 0, x, y, z, 0, 0, 0);
    const dBodyID body = AddBody(mass, {top[0], top[1], kTubeCentre_z_m});
    dGeomSetBody(dCreateCapsule(world_.space(), kOuterRadius_m, tube.length_m - 2 * kOuterRadius_m),
                 body);
    world_.contacts().AddObject(body, static_cast<uint32_t>(index + 1));
    const dBodyID thread = AddThread(top, node);
    Pin(thread, nullptr, top);
    Pin(thread, body, node);
  }

  void HangClapper() {
    const Vector top{0, 0, 0}, middle{0, 0, kClapper_z_m}, bottom{0, 0, kSail_z_m};
    dMass mass;
    dMassSetSphereTotal(&mass, kClapperMass_kg, kClapperRadius_m);
    clapper_ = AddBody(mass, middle);
    dGeomSetBody(dCreateSphere(world_.space(), kClapperRadius_m), clapper_);
    dMassSetBoxTotal(&mass, kSailMass_kg, kSailSide_m, 0.001, kSailSide_m);
    sail_ = AddBody(mass, bottom);
    const dBodyID upper = AddThread(top, middle), lower = AddThread(middle, bottom);
    Pin(upper, nullptr, top);
    Pin(upper, clapper_, middle);
    Pin(lower, clapper_, middle);
    Pin(lower, sail_, bottom);
  }

  double RestitutionOf(dBodyID body) const {
    return body == clapper_ ? kClapperRestitution : kTubeRestitution;
  }
  examples::OdeSurface SurfaceOf(dBodyID a, dBodyID b) const {
    return {.friction = 0.5,
            .restitution = RestitutionOf(a) * RestitutionOf(b),
            .slowest_bounce_m_per_s = kSlowest_m_per_s};
  }

  const Purpose purpose_;
  const Gust gust_;
  dBodyID clapper_ = nullptr, sail_ = nullptr;
  examples::OdeWorld world_{kStep_s,
                            {.roughness_depth = 0, .striker = "wood"},
                            [this](dBodyID a, dBodyID b) { return SurfaceOf(a, b); }};
  uint64_t step_count_ = 0;
};

}  // namespace

Simulation ChimesInOde(uint64_t seed, Purpose purpose) {
  return [chimes = std::make_shared<OdeChimes>(seed, purpose)] { return chimes->Step(); };
}

}  // namespace carillon::wind_chimes
