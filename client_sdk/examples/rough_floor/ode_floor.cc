// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <cmath>

#include "client_sdk/examples/ode_world.h"
#include "client_sdk/examples/rough_floor/rough_floor.h"

namespace carillon::rough_floor {
namespace {

class OdeFloor {
 public:
  OdeFloor(Scene scene, const Body& body, double step_s)
      : scene_(scene), step_s_(step_s), world_(step_s, {}, [](dBodyID, dBodyID) {
          return examples::OdeSurface{.friction = 0.5, .restitution = 0.3};
        }) {
    dWorldSetGravity(world_.world(), 0, 0, -9.81);
    world_.SoftenContacts();
    dCreatePlane(world_.space(), 0, 0, 1, 0);
    if (scene == Scene::kRoll) {
      AddBowl(body);
    } else {
      AddBox(body);
    }
    world_.contacts().AddObject(body_, 1);
  }

  v1::ContactStep Step() {
    const double time_s = static_cast<double>(++step_count_) * step_s_;
    if (scene_ == Scene::kDrag && time_s > kDragStart_s && time_s < kDragEnd_s) {
      dBodySetLinearVel(body_, kDragSpeed_m_per_s, 0, dBodyGetLinearVel(body_)[2]);
    }
    return world_.Step(time_s);
  }

 private:
  void AddBox(const Body& body) {
    const auto& [x, y, z] = body.box_m;
    dMass mass;
    dMassSetBoxTotal(&mass, body.mass_kg, x, y, z);
    dBodySetMass(body_, &mass);
    dGeomSetBody(dCreateBox(world_.space(), x, y, z), body_);
    dBodySetPosition(body_, 0, 0, z / 2 + kDropHeight_m);
  }

  /// Tilted, the middle of its sphere one radius above the floor.
  void AddBowl(const Body& body) {
    const double radius = body.bowl_radius_m, square = body.mass_kg * radius * radius;
    dMass mass;
    dMassSetParameters(&mass, body.mass_kg, 0, 0, 0, 5 * square / 12, 5 * square / 12,
                       2 * square / 3, 0, 0, 0);
    dBodySetMass(body_, &mass);
    const dGeomID geom = dCreateSphere(world_.space(), radius);
    dGeomSetBody(geom, body_);
    dGeomSetOffsetPosition(geom, 0, 0, radius / 2);
    dMatrix3 tilt;
    dRFromAxisAndAngle(tilt, 0, 1, 0, kTilt_rad);
    dBodySetRotation(body_, tilt);
    dBodySetPosition(body_, -radius / 2 * std::sin(kTilt_rad), 0,
                     radius - radius / 2 * std::cos(kTilt_rad));
    dBodySetAngularVel(body_, 0, 0, kRollSpin_rad_per_s);
  }

  const Scene scene_;
  const double step_s_;
  examples::OdeWorld world_;
  const dBodyID body_ = dBodyCreate(world_.world());
  int step_count_ = 0;
};

}  // namespace

Simulation SimulateInOde(Scene scene, const Body& body, double step_s) {
  return [floor = std::make_shared<OdeFloor>(scene, body, step_s)] { return floor->Step(); };
}

}  // namespace carillon::rough_floor
