// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <array>
#include <memory>

#include "client_sdk/adapters/ode_contacts.h"
#include "client_sdk/examples/wind_chimes/gust.h"
#include "client_sdk/examples/wind_chimes/hanging.h"
#include "client_sdk/examples/wind_chimes/tubes.h"
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

namespace carillon::wind_chimes {
namespace {

/// ODE's own memory, once for the process.
void InitializeOde() {
  static const bool initialized = dInitODE2(0) != 0;
  (void)initialized;
}

class OdeChimes {
 public:
  OdeChimes(uint64_t seed, Purpose purpose)
      : purpose_(purpose), gust_(seed), contacts_({.roughness_depth = 0, .striker = "wood"}) {
    dWorldSetGravity(world_, 0, 0, -9.81);
    // ODE takes a share of the velocity in each step.
    dWorldSetLinearDamping(world_, kLinearDamping * kStep_s);
    dWorldSetAngularDamping(world_, kAngularDamping * kStep_s);
    dWorldSetLinearDampingThreshold(world_, 0);
    dWorldSetAngularDampingThreshold(world_, 0);
    for (size_t i = 0; i < kTubes.size(); ++i) HangTube(i);
    HangClapper();
    if (purpose == Purpose::kSound) return;
    contacts_.AddObject(clapper_, kClapperHandle);
    contacts_.AddObject(sail_, kSailHandle);
  }
  ~OdeChimes() {
    dJointGroupDestroy(touching_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  OdeChimes(const OdeChimes&) = delete;
  OdeChimes& operator=(const OdeChimes&) = delete;

  v1::ContactStep Step() {
    v1::ContactStep step;
    step.set_time_s(static_cast<double>(step_count_++) * kStep_s);
    BlowOnSail(step.time_s());
    dSpaceCollide(space_, this, &OdeChimes::Near);
    dWorldStep(world_, kStep_s);
    contacts_.Read(kStep_s, step);
    if (purpose_ == Purpose::kPicture) contacts_.ReadPoses(step);
    dJointGroupEmpty(touching_);
    for (v1::EngineContact& contact : *step.mutable_contacts()) {
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
    const dBodyID body = dBodyCreate(world_);
    dBodySetMass(body, &mass);
    dBodySetPosition(body, centre[0], centre[1], centre[2]);
    return body;
  }

  /// Joins two bodies, or one to the world if `other` is null, at a point given in the world.
  void Pin(dBodyID body, dBodyID other, const Vector& point) {
    const dJointID joint = dJointCreateBall(world_, nullptr);
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
    dGeomSetBody(dCreateCapsule(space_, kOuterRadius_m, tube.length_m - 2 * kOuterRadius_m), body);
    contacts_.AddObject(body, static_cast<uint32_t>(index + 1));
    const dBodyID thread = AddThread(top, node);
    Pin(thread, nullptr, top);
    Pin(thread, body, node);
  }

  void HangClapper() {
    const Vector top{0, 0, 0}, middle{0, 0, kClapper_z_m}, bottom{0, 0, kSail_z_m};
    dMass mass;
    dMassSetSphereTotal(&mass, kClapperMass_kg, kClapperRadius_m);
    clapper_ = AddBody(mass, middle);
    dGeomSetBody(dCreateSphere(space_, kClapperRadius_m), clapper_);
    dMassSetBoxTotal(&mass, kSailMass_kg, kSailSide_m, 0.001, kSailSide_m);
    sail_ = AddBody(mass, bottom);
    const dBodyID upper = AddThread(top, middle), lower = AddThread(middle, bottom);
    Pin(upper, nullptr, top);
    Pin(upper, clapper_, middle);
    Pin(lower, clapper_, middle);
    Pin(lower, sail_, bottom);
  }

  static void Near(void* data, dGeomID a, dGeomID b) {
    auto& self = *static_cast<OdeChimes*>(data);
    const std::array<dBodyID, 2> bodies{dGeomGetBody(a), dGeomGetBody(b)};
    constexpr int kMost = 4;
    std::array<dContactGeom, kMost> points;
    const int count = dCollide(a, b, kMost, points.data(), sizeof(dContactGeom));
    for (int i = 0; i < count; ++i) {
      dContact contact{};
      contact.geom = points[static_cast<size_t>(i)];
      contact.surface.mode = dContactBounce | dContactApprox1;
      contact.surface.mu = 0.5;
      contact.surface.bounce = 1;
      for (const dBodyID body : bodies) {
        contact.surface.bounce *= body == self.clapper_ ? kClapperRestitution : kTubeRestitution;
      }
      contact.surface.bounce_vel = kSlowest_m_per_s;
      const dJointID joint = dJointCreateContact(self.world_, self.touching_, &contact);
      dJointAttach(joint, bodies[0], bodies[1]);
      self.contacts_.Add(joint, contact.geom);
    }
  }

  const Purpose purpose_;
  const Gust gust_;
  dWorldID world_ = dWorldCreate();
  dSpaceID space_ = dSimpleSpaceCreate(nullptr);
  dJointGroupID touching_ = dJointGroupCreate(0);
  dBodyID clapper_ = nullptr, sail_ = nullptr;
  adapters::OdeContacts contacts_;
  uint64_t step_count_ = 0;
};

}  // namespace

Simulation ChimesInOde(uint64_t seed, Purpose purpose) {
  InitializeOde();
  return [chimes = std::make_shared<OdeChimes>(seed, purpose)] { return chimes->Step(); };
}

}  // namespace carillon::wind_chimes
