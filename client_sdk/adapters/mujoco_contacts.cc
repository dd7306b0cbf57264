// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/mujoco_contacts.h"

#include <array>
#include <cmath>

namespace carillon::adapters {
namespace {

Vector VectorFrom(const mjtNum* v) { return {v[0], v[1], v[2]}; }

Quaternion QuaternionFrom(const mjtNum* q) { return {q[0], q[1], q[2], q[3]}; }

/// The impulse of the step on the first body, N s, in the world. The rows of the contact's frame
/// are its axes; mj_contactForce has the force on the second body along them.
Vector ImpulseOfContact(const mjModel& model, const mjData& data, int number) {
  std::array<mjtNum, 6> force{};
  mj_contactForce(&model, &data, number, force.data());
  Vector impulse{};
  mju_rotVecMatT(impulse.data(), force.data(), data.contact[number].frame);
  mju_scl3(impulse.data(), impulse.data(), -model.opt.timestep);
  return impulse;
}

}  // namespace

void MujocoContacts::Read(const mjData& data, v1::ContactStep& step) {
  for (int i = 0; i < data.ncon; ++i) {
    const mjContact& contact = data.contact[i];
    if (contact.efc_address < 0) continue;  // within its margin, and without a force
    const Vector impulse = ImpulseOfContact(model_, data, i);
    if (impulse == Vector{}) continue;
    rows_.Append(
        {.sides = {SideOf(data, contact.geom1, contact), SideOf(data, contact.geom2, contact)},
         .normal = VectorFrom(contact.frame),
         .impulse_on_first_newton_seconds = impulse},
        step);
  }
}

ContactSide MujocoContacts::SideOf(const mjData& data, int geom, const mjContact& contact) const {
  const int body = model_.geom_bodyid[geom];
  if (model_.body_weldid[body] == 0)
    return {.body = KeyOf(body), .point_m = VectorFrom(contact.pos)};
  const mjtNum* orientation = data.xquat + 4 * body;
  Vector arm{}, local{}, from_centre{}, turning{};
  std::array<mjtNum, 4> inverse{};
  std::array<mjtNum, 6> velocity{};  // turning, then moving, at the body's centre of mass
  mju_sub3(arm.data(), contact.pos, data.xpos + 3 * body);
  mju_negQuat(inverse.data(), orientation);
  mju_rotVecQuat(local.data(), arm.data(), inverse.data());
  mj_objectVelocity(&model_, &data, mjOBJ_BODY, body, velocity.data(), 0);
  mju_sub3(from_centre.data(), contact.pos, data.xipos + 3 * body);
  mju_cross(turning.data(), velocity.data(), from_centre.data());
  mju_addTo3(turning.data(), velocity.data() + 3);
  return {.body = KeyOf(body),
          .point_m = local,
          .orientation = QuaternionFrom(orientation),
          .velocity_m_per_s = turning,
          .angular_velocity_rad_per_s = VectorFrom(velocity.data()),
          .lever_m = std::abs(mju_dot3(from_centre.data(), contact.frame)),
          .mass_kg = model_.body_mass[body]};
}

void MujocoContacts::ReadPoses(const mjData& data, v1::ContactStep& step) const {
  for (const auto& [key, handle] : rows_.handles()) {
    const int body = BodyOf(key);
    rows_.AppendPose(key, VectorFrom(data.xpos + 3 * body), QuaternionFrom(data.xquat + 4 * body),
                     step);
  }
}

}  // namespace carillon::adapters
