// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <array>
#include <memory>

#include "client_sdk/adapters/ode_contacts.h"
#include "client_sdk/examples/falls/fall.h"

namespace carillon::falls {
namespace {

/// Creates a world, once the process has ODE's own memory.
dWorldID CreateWorld() {
  static const bool initialized = dInitODE2(0) != 0;
  static_cast<void>(initialized);
  return dWorldCreate();
}

class OdeFall {
 public:
  OdeFall(const FallScene& scene, double step_s)
      : step_s_(step_s),
        friction_(scene.friction),
        restitution_(scene.restitution),
        contacts_({.roughness_depth = scene.roughness_depth,
                   .irregularity_length_m = scene.irregularity_length_m}) {
    const auto& [x, y, z] = scene.gravity_m_per_s2;
    dWorldSetGravity(world_, x, y, z);
    // Contacts as soft as the manual of ODE advises for bodies that rest on one another.
    dWorldSetCFM(world_, 1e-6);
    dWorldSetContactSurfaceLayer(world_, 1e-4);
    uint32_t handle = 0;
    for (const Body& body : scene.bodies) Add(body, ++handle);
  }
  OdeFall(const OdeFall&) = delete;
  OdeFall& operator=(const OdeFall&) = delete;
  ~OdeFall() {
    dJointGroupDestroy(joints_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }

  v1::ContactStep Step() {
    v1::ContactStep step;
    step.set_time_s(static_cast<double>(++step_count_) * step_s_);
    dSpaceCollide(space_, this, &OdeFall::Near);
    dWorldStep(world_, step_s_);
    contacts_.Read(step_s_, step);
    dJointGroupEmpty(joints_);
    contacts_.ReadPoses(step);
    return step;
  }

 private:
  void Add(const Body& body, uint32_t handle) {
    const bool is_plane = std::holds_alternative<Plane>(body.shape);
    const dBodyID made = is_plane ? nullptr : dBodyCreate(world_);
    const dSpaceID parts = dSimpleSpaceCreate(space_);  // the parts of one body do not meet
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
    if (!body.model.empty()) contacts_.AddObject(made, handle);
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

  static void Near(void* data, dGeomID a, dGeomID b) {
    auto& self = *static_cast<OdeFall*>(data);
    if (dGeomIsSpace(a) != 0 || dGeomIsSpace(b) != 0) return dSpaceCollide2(a, b, data, &Near);
    if (dGeomGetBody(a) == dGeomGetBody(b)) return;
    constexpr int kMost = 8;
    std::array<dContactGeom, kMost> points;
    const int count = dCollide(a, b, kMost, points.data(), sizeof(dContactGeom));
    for (int i = 0; i < count; ++i) self.Join(a, b, points[static_cast<size_t>(i)]);
  }

  void Join(dGeomID a, dGeomID b, const dContactGeom& geometry) {
    dContact contact{};
    contact.geom = geometry;
    contact.surface.mode = dContactBounce | dContactApprox1;
    contact.surface.mu = friction_;
    contact.surface.bounce = restitution_;
    contact.surface.bounce_vel = kSlowestBounce_m_per_s;
    const dJointID joint = dJointCreateContact(world_, joints_, &contact);
    dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
    contacts_.Add(joint, geometry);
  }

  static constexpr double kSlowestBounce_m_per_s = 0.05;

  const double step_s_, friction_, restitution_;
  const dWorldID world_ = CreateWorld();
  const dSpaceID space_ = dSimpleSpaceCreate(nullptr);
  const dJointGroupID joints_ = dJointGroupCreate(0);  ///< the contacts of the step
  adapters::OdeContacts contacts_;
  int step_count_ = 0;
};

}  // namespace

Simulation FallInOde(const FallScene& scene, double step_s) {
  return [fall = std::make_shared<OdeFall>(scene, step_s)] { return fall->Step(); };
}

}  // namespace carillon::falls
