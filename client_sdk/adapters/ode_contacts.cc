// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/ode_contacts.h"

#include <algorithm>
#include <cmath>

namespace carillon::adapters {
namespace {

using Vector = std::array<double, 3>;

Vector ToArray(const dReal* v) { return {v[0], v[1], v[2]}; }

Vector Minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

double TangentialLength(const Vector& v, const Vector& normal) {
  const double along = Dot(v, normal);
  return std::sqrt(std::max(Dot(v, v) - along * along, 0.0));
}

void Set(v1::Vec3& target, const Vector& source) {
  target.set_x(source[0]);
  target.set_y(source[1]);
  target.set_z(source[2]);
}

void Set(v1::Quaternion& target, const dReal* source) {
  target.set_w(source[0]);
  target.set_x(source[1]);
  target.set_y(source[2]);
  target.set_z(source[3]);
}

/// From the frame of `from` into that of `to`.
void SetRotation(dBodyID from, dBodyID to, v1::Quaternion& rotation) {
  dQuaternion product;
  dQMultiply1(product, dBodyGetQuaternion(to), dBodyGetQuaternion(from));  // inverse of the first
  Set(rotation, product);
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
    contact.local_point[static_cast<size_t>(side)] = ToArray(local);
  }
  dJointSetFeedback(joint, &contact.feedback);
}

void OdeContacts::Read(double step_s, v1::ContactStep& step) {
  for (const Contact& contact : contacts_) {
    const auto heard_0 = handles_.find(contact.bodies[0]);
    const auto heard_1 = handles_.find(contact.bodies[1]);
    if (heard_0 == handles_.end() && heard_1 == handles_.end()) continue;
    // Always the same of a pair comes first, however the joint orders them.
    const bool second_first = heard_0 == handles_.end() ||
                              (heard_1 != handles_.end() && heard_1->second < heard_0->second);
    Append(contact, second_first ? 1 : 0, step_s, step);
  }
  contacts_.clear();
}

void OdeContacts::Append(const Contact& contact, size_t side, double step_s,
                         v1::ContactStep& step) {
  const dBodyID body = contact.bodies[side], other = contact.bodies[1 - side];
  // ODE takes a joint's only body for its first one, though dJointGetBody does not.
  const bool is_first = side == 0 || other == nullptr;
  const Vector force = ToArray(is_first ? contact.feedback.f1 : contact.feedback.f2);
  if (Dot(force, force) == 0) return;
  dVector3 local_force;
  dBodyVectorFromWorld(body, static_cast<dReal>(force[0]), static_cast<dReal>(force[1]),
                       static_cast<dReal>(force[2]), local_force);
  v1::EngineContact& row = *step.add_contacts();
  row.set_object(handles_.at(body));
  const auto next = static_cast<uint32_t>(partners_.size());
  row.set_partner(partners_.try_emplace(other, next).first->second);
  Set(*row.mutable_point_m(), contact.local_point[side]);
  Vector impulse = ToArray(local_force);
  for (double& component : impulse) component *= step_s;
  Set(*row.mutable_impulse_newton_seconds(), impulse);
  row.set_duration_s(settings_.duration_s);
  v1::Roughness& roughness = *row.mutable_roughness();
  roughness.set_travel_speed_m_per_s(TravelSpeed(contact));
  roughness.set_depth(settings_.roughness_depth);
  roughness.set_grain_m(settings_.grain_m);
  if (const auto heard = handles_.find(other); heard != handles_.end()) {
    v1::SecondObject& second = *row.mutable_second();
    second.set_object(heard->second);
    Set(*second.mutable_point_m(), contact.local_point[1 - side]);
    SetRotation(body, other, *second.mutable_rotation());
  }
}

void OdeContacts::ReadPoses(v1::ContactStep& step) const {
  for (const auto& [body, handle] : handles_) {
    v1::ObjectPose& pose = *step.add_poses();
    pose.set_object(handle);
    Set(*pose.mutable_pose()->mutable_position_m(), ToArray(dBodyGetPosition(body)));
    Set(*pose.mutable_pose()->mutable_orientation(), dBodyGetQuaternion(body));
  }
}

/// As BulletContacts has it: the slip, and for a roll omega R.
double OdeContacts::TravelSpeed(const Contact& contact) {
  std::array<Vector, 2> velocity{}, spin{};
  double lever_m = 0;
  for (size_t side = 0; side < 2; ++side) {
    const dBodyID body = contact.bodies[side];
    if (body == nullptr) continue;
    const auto& [x, y, z] = contact.point;
    dVector3 at_point;
    dBodyGetPointVel(body, static_cast<dReal>(x), static_cast<dReal>(y), static_cast<dReal>(z),
                     at_point);
    velocity[side] = ToArray(at_point);
    spin[side] = ToArray(dBodyGetAngularVel(body));
    const Vector arm = Minus(contact.point, ToArray(dBodyGetPosition(body)));
    lever_m = std::max(lever_m, std::abs(Dot(arm, contact.normal)));
  }
  return TangentialLength(Minus(velocity[0], velocity[1]), contact.normal) +
         TangentialLength(Minus(spin[0], spin[1]), contact.normal) * lever_m;
}

}  // namespace carillon::adapters
