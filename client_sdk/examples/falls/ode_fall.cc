// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <memory>

#include "client_sdk/examples/falls/fall.h"
#include "client_sdk/examples/ode_world.h"

namespace carillon::falls {
namespace {

class OdeFall {
 public:
  OdeFall(const FallScene& scene, double step_s)
      : step_s_(step_s),
        world_(step_s,
               {.roughness_depth = scene.roughness_depth,
                .irregularity_length_m = scene.irregularity_length_m},
               [surface = examples::OdeSurface{.friction = scene.friction,
                                               .restitution = scene.restitution}](
                   dBodyID, dBodyID) { return surface; }) {
    const auto& [x, y, z] = scene.gravity_m_per_s2;
    dWorldSetGravity(world_.world(), x, y, z);
    world_.SoftenContacts();
    uint32_t handle = 0;
    for (const Body& body : scene.bodies) Add(body, ++handle);
  }

  v1::ContactStep Step() {
    v1::ContactStep step = world_.Step(static_cast<double>(++step_count_) * step_s_);
    world_.contacts().ReadPoses(step);
    return step;
  }

 private:
  void Add(const Body& body, uint32_t handle) {
    const bool is_plane = std::holds_alternative<Plane>(body.shape);
    const dBodyID made = is_plane ? nullptr : dBodyCreate(world_.world());
    const dSpaceID parts = dSimpleSpaceCreate(world_.space());  // the parts of one body do not meet
    dSpaceSetSublevel(parts, 1);
    std::visit([&](const auto& shape) { AddShape(shape, parts, made, body); }, body.shape);
    if (made == nullptr) return;
    SetMass(made, body);
    const auto& [x, y, z] = body.position_m;
    dBodySetPosition(made, x, y, z);
    dBodySetQuaternion(made, body.orientation.data());
    const auto& [vx, vy, vz] = body.velocity_m_per_s;
    dBodySetLinearVel(made, vx, vy, vz);
    const auto& [wx, wy, wz] = body.angular_velocity_rad_per_s;
    dBodySetAngularVel(made, wx, wy, wz);
    if (!body.model.empty()) world_.contacts().AddObject(made, handle);
  }

  static void AddShape(const Plane&, dSpaceID parts, dBodyID, const Body& body) {
    dCreatePlane(parts, 0, 0, 1, body.position_m[2]);
  }
  static void AddShape(const Ball& ball, dSpaceID parts, dBodyID made, const Body&) {
    Place(dCreateSphere(parts, ball.radius_m), made, {});
  }
  static void AddShape(const std::vector<Box>& boxes, dSpaceID parts, dBodyID made, const Body&) {
    for (const Box& box : boxes) {
      const auto& [x, y, z] = box.sides_m;
      Place(dCreateBox(parts, x, y, z), made, box);
    }
  }
  static void AddShape(const Hull&, dSpaceID, dBodyID, const Body&) {}  // main.cc refuses these

  /// Puts a geometry where `box` is in the frame of its body.
  static void Place(dGeomID geometry, dBodyID made, const Box& box) {
    dGeomSetBody(geometry, made);
    dGeomSetOffsetPosition(geometry, box.position_m[0], box.position_m[1], box.position_m[2]);
    dGeomSetOffsetQuaternion(geometry, box.orientation.data());
  }

  static void SetMass(dBodyID made, const Body& body) {
    if (body.mass_kg <= 0) return dBodySetKinematic(made);
    const auto& [x, y, z] = body.inertia_kg_m2;
    dMass mass;
    dMassSetParameters(&mass, body.mass_kg, 0, 0, 0, x, y, z, 0, 0, 0);
    dBodySetMass(made, &mass);
  }

  const double step_s_;
  examples::OdeWorld world_;
  int step_count_ = 0;
};

}  // namespace

Simulation FallInOde(const FallScene& scene, double step_s) {
  return [fall = std::make_shared<OdeFall>(scene, step_s)] { return fall->Step(); };
}

}  // namespace carillon::falls
