// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <cmath>

#include "client_sdk/adapters/ode_contacts.h"
#include "client_sdk/examples/rough_floor/rough_floor.h"

namespace carillon::rough_floor {
namespace {

/// ODE's own memory, once for the process.
void InitializeOde() {
  static const bool initialized = [] {
    dInitODE2(0);
    return true;
  }();
  (void)initialized;
}

dReal Real(double x) { return static_cast<dReal>(x); }

class OdeWorld {
 public:
  OdeWorld(Scene scene, const Body& body, double step_s)
      : scene_(scene), step_s_(step_s), contacts_({}) {
    dWorldSetGravity(world_, 0, 0, Real(-9.81));
    // The engine's manual: soft enough for a contact to stay.
    dWorldSetCFM(world_, Real(1e-6));
    dWorldSetContactSurfaceLayer(world_, Real(1e-4));
    dCreatePlane(space_, 0, 0, 1, 0);
    if (scene == Scene::kRoll) {
      AddBowl(body);
    } else {
      AddBox(body);
    }
    contacts_.AddObject(body_, 1);
  }
  ~OdeWorld() {
    dJointGroupDestroy(joints_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }
  OdeWorld(const OdeWorld&) = delete;
  OdeWorld& operator=(const OdeWorld&) = delete;

  v1::ContactStep Step() {
    v1::ContactStep step;
    const double time_s = static_cast<double>(++step_count_) * step_s_;
    step.set_time_s(time_s);
    if (scene_ == Scene::kDrag && time_s > kDragStart_s && time_s < kDragEnd_s) {
      dBodySetLinearVel(body_, Real(kDragSpeed_m_per_s), 0, dBodyGetLinearVel(body_)[2]);
    }
    dSpaceCollide(space_, this, &OdeWorld::Near);
    dWorldStep(world_, Real(step_s_));
    contacts_.Read(step_s_, step);
    dJointGroupEmpty(joints_);
    return step;
  }

 private:
  void AddBox(const Body& body) {
    const auto& [x, y, z] = body.box_m;
    dMass mass;
    dMassSetBoxTotal(&mass, Real(body.mass_kg), Real(x), Real(y), Real(z));
    dBodySetMass(body_, &mass);
    dGeomSetBody(dCreateBox(space_, Real(x), Real(y), Real(z)), body_);
    dBodySetPosition(body_, 0, 0, Real(z / 2 + kDropHeight_m));
  }

  /// Tilted, the middle of its sphere one radius above the floor.
  void AddBowl(const Body& body) {
    const double radius = body.bowl_radius_m, square = body.mass_kg * radius * radius;
    dMass mass;
    dMassSetParameters(&mass, Real(body.mass_kg), 0, 0, 0, Real(5 * square / 12),
                       Real(5 * square / 12), Real(2 * square / 3), 0, 0, 0);
    dBodySetMass(body_, &mass);
    const dGeomID geom = dCreateSphere(space_, Real(radius));
    dGeomSetBody(geom, body_);
    dGeomSetOffsetPosition(geom, 0, 0, Real(radius / 2));
    dMatrix3 tilt;
    dRFromAxisAndAngle(tilt, 0, 1, 0, Real(kTilt_rad));
    dBodySetRotation(body_, tilt);
    dBodySetPosition(body_, Real(-radius / 2 * std::sin(kTilt_rad)), 0,
                     Real(radius - radius / 2 * std::cos(kTilt_rad)));
    dBodySetAngularVel(body_, 0, 0, Real(kRollSpin_rad_per_s));
  }

  static void Near(void* data, dGeomID a, dGeomID b) {
    auto& self = *static_cast<OdeWorld*>(data);
    constexpr int kMost = 8;
    std::array<dContactGeom, kMost> points;
    const int count = dCollide(a, b, kMost, points.data(), sizeof(dContactGeom));
    for (int i = 0; i < count; ++i) {
      dContact contact{};
      contact.geom = points[static_cast<size_t>(i)];
      contact.surface.mode = dContactBounce | dContactApprox1;
      contact.surface.mu = Real(0.5);
      contact.surface.bounce = Real(0.3);
      contact.surface.bounce_vel = Real(0.05);
      const dJointID joint = dJointCreateContact(self.world_, self.joints_, &contact);
      dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
      self.contacts_.Add(joint, contact.geom);
    }
  }

  const Scene scene_;
  const double step_s_;
  dWorldID world_ = dWorldCreate();
  dSpaceID space_ = dSimpleSpaceCreate(nullptr);
  dJointGroupID joints_ = dJointGroupCreate(0);
  dBodyID body_ = dBodyCreate(world_);
  adapters::OdeContacts contacts_;
  int step_count_ = 0;
};

}  // namespace

Simulation SimulateInOde(Scene scene, const Body& body, double step_s) {
  InitializeOde();
  return [world = std::make_shared<OdeWorld>(scene, body, step_s)] { return world->Step(); };
}

}  // namespace carillon::rough_floor
