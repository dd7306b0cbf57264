// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/ode_world.h"

#include <array>
#include <utility>

namespace carillon::examples {
namespace {

/// Creates a world, once the process has ODE's own memory.
dWorldID CreateWorld() {
  static const bool initialized = dInitODE2(0) != 0;
  static_cast<void>(initialized);
  return dWorldCreate();
}

}  // namespace

OdeWorld::OdeWorld(double step_s, const adapters::ContactSettings& settings,
                   OdeSurfaceOf surface_of)
    : step_s_(step_s),
      surface_of_(std::move(surface_of)),
      world_(CreateWorld()),
      space_(dSimpleSpaceCreate(nullptr)),
      joints_(dJointGroupCreate(0)),
      contacts_(settings) {}

OdeWorld::~OdeWorld() {
  dJointGroupDestroy(joints_);
  dSpaceDestroy(space_);
  dWorldDestroy(world_);
}

void OdeWorld::SoftenContacts() {
  dWorldSetCFM(world_, 1e-6);
  dWorldSetContactSurfaceLayer(world_, 1e-4);
}

v1::ContactStep OdeWorld::Step(double time_s) {
  v1::ContactStep step;
  step.set_time_s(time_s);
  dSpaceCollide(space_, this, &OdeWorld::Near);
  dWorldStep(world_, step_s_);
  contacts_.Read(step_s_, step);
  dJointGroupEmpty(joints_);
  return step;
}

void OdeWorld::Near(void* data, dGeomID a, dGeomID b) {
  auto& self = *static_cast<OdeWorld*>(data);
  if (dGeomIsSpace(a) != 0 || dGeomIsSpace(b) != 0) return dSpaceCollide2(a, b, data, &Near);
  if (dGeomGetBody(a) == dGeomGetBody(b)) return;
  constexpr int kMost = 8;
  std::array<dContactGeom, kMost> points;
  const int count = dCollide(a, b, kMost, points.data(), sizeof(dContactGeom));
  for (int i = 0; i < count; ++i) self.Join(a, b, points[static_cast<size_t>(i)]);
}

void OdeWorld::Join(dGeomID a, dGeomID b, const dContactGeom& geometry) {
  const OdeSurface surface = surface_of_(dGeomGetBody(a), dGeomGetBody(b));
  dContact contact{};
  contact.geom = geometry;
  contact.surface.mode = dContactBounce | dContactApprox1;
  contact.surface.mu = surface.friction;
  contact.surface.bounce = surface.restitution;
  contact.surface.bounce_vel = surface.slowest_bounce_m_per_s;
  const dJointID joint = dJointCreateContact(world_, joints_, &contact);
  dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
  contacts_.Add(joint, geometry);
}

}  // namespace carillon::examples
