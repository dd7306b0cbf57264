// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/ode_contacts.h"

#include <cmath>

namespace carillon::adapters {
namespace {

Vector ToArray(const dReal* v) { return {v[0], v[1], v[2]}; }

Quaternion ToQuaternion(const dReal* q) { return {q[0], q[1], q[2], q[3]}; }

/// The impulse of a step on the first body of a contact joint, in the world. ODE takes a joint's
/// only body for its first one, though dJointGetBody does not.
Vector ImpulseOnFirst(const dReal* force, bool first_is_world, double step_s) {
  const double scale = first_is_world ? -step_s : step_s;
  return {scale * force[0], scale * force[1], scale * force[2]};
}

}  // namespace

void OdeContacts::Add(dJointID joint, const dContactGeom& geometry) {
  Contact& contact = contacts_.emplace_back();
  contact.normal = ToArray(geometry.normal);
  contact.point = ToArray(geometry.pos);
  for (int side = 0; side < 2; ++side) {
    const dBodyID body = dJointGetBody(joint, side);
    contact.bodies[static_cast<size_t>(side)] = body;
    if (body == nullptr) continue;
    dVector3 local;
    dBodyGetPosRelPoint(body, geometry.pos[0], geometry.pos[1], geometry.pos[2], local);
    contact.local_points[static_cast<size_t>(side)] = ToArray(local);
  }
  dJointSetFeedback(joint, &contact.feedback);
}

void OdeContacts::Read(double step_s, v1::ContactStep& step) {
  for (const Contact& contact : contacts_) {
    const dReal* force = contact.feedback.f1;
    if (force[0] == 0 && force[1] == 0 && force[2] == 0) continue;
    rows_.Append({.sides = {SideOf(contact, 0), SideOf(contact, 1)},
                  .normal = contact.normal,
                  .impulse_on_first_newton_seconds =
                      ImpulseOnFirst(force, contact.bodies[0] == nullptr, step_s)},
                 step);
  }
  contacts_.clear();
}

ContactSide OdeContacts::SideOf(const Contact& contact, size_t side) {
  const dBodyID body = contact.bodies[side];
  if (body == nullptr) return {};
  const auto& [x, y, z] = contact.point;
  dVector3 velocity;
  dBodyGetPointVel(body, static_cast<dReal>(x), static_cast<dReal>(y), static_cast<dReal>(z),
                   velocity);
  const Vector centre = ToArray(dBodyGetPosition(body));
  double lever_m = 0;
  for (size_t i = 0; i < 3; ++i) lever_m += (contact.point[i] - centre[i]) * contact.normal[i];
  dMass mass;
  dBodyGetMass(body, &mass);
  const bool moves = dBodyIsKinematic(body) == 0;
  return {.body = body,
          .point_m = contact.local_points[side],
          .orientation = ToQuaternion(dBodyGetQuaternion(body)),
          .velocity_m_per_s = ToArray(velocity),
          .angular_velocity_rad_per_s = ToArray(dBodyGetAngularVel(body)),
          .lever_m = std::abs(lever_m),
          .mass_kg = moves ? std::optional<double>(mass.mass) : std::nullopt};
}

void OdeContacts::ReadPoses(v1::ContactStep& step) const {
  for (const auto& [address, handle] : rows_.handles()) {
    const auto body = static_cast<dBodyID>(const_cast<void*>(address));
    rows_.AppendPose(address, ToArray(dBodyGetPosition(body)),
                     ToQuaternion(dBodyGetQuaternion(body)), step);
  }
}

}  // namespace carillon::adapters
