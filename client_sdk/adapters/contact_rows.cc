// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/contact_rows.h"

#include <algorithm>
#include <cmath>

namespace carillon::adapters {
namespace {

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector Minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double TangentialLength(const Vector& v, const Vector& normal) {
  const double along = Dot(v, normal);
  return std::sqrt(std::max(Dot(v, v) - along * along, 0.0));
}

Quaternion Inverse(const Quaternion& q) { return {q[0], -q[1], -q[2], -q[3]}; }

Quaternion Times(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

Vector Rotate(const Quaternion& q, const Vector& v) {
  const Quaternion turned = Times(Times(q, {0, v[0], v[1], v[2]}), Inverse(q));
  return {turned[1], turned[2], turned[3]};
}

void Set(v1::Vec3& target, const Vector& source) {
  target.set_x(source[0]);
  target.set_y(source[1]);
  target.set_z(source[2]);
}

void Set(v1::Quaternion& target, const Quaternion& source) {
  target.set_w(source[0]);
  target.set_x(source[1]);
  target.set_y(source[2]);
  target.set_z(source[3]);
}

/// The speed at which a contact travels over the surfaces. In a slide this is the speed of one
/// surface over the other; in a roll it is the speed of the contact point, which moves at omega R
/// over a body whose centre of mass is at the distance R.
double TravelSpeed(const ContactReport& contact) {
  const auto& [a, b] = contact.sides;
  const Vector slip = Minus(a.velocity_m_per_s, b.velocity_m_per_s);
  const Vector roll = Minus(a.angular_velocity_rad_per_s, b.angular_velocity_rad_per_s);
  return TangentialLength(slip, contact.normal) +
         TangentialLength(roll, contact.normal) * std::max(a.lever_m, b.lever_m);
}

}  // namespace

uint32_t ContactRows::PartnerNumber(const void* body) {
  const auto [partner, is_new] = partners_.try_emplace(body, partner_count_);
  if (is_new) ++partner_count_;
  return partner->second;
}

void ContactRows::RemoveObject(const void* body) {
  handles_.erase(body);
  partners_.erase(body);
}

void ContactRows::Append(const ContactReport& contact, v1::ContactStep& step) {
  const auto heard_0 = handles_.find(contact.sides[0].body);
  const auto heard_1 = handles_.find(contact.sides[1].body);
  const bool has_0 = heard_0 != handles_.end(), has_1 = heard_1 != handles_.end();
  if (!has_0 && !has_1) return;
  const bool swapped = !has_0 || (has_1 && heard_1->second < heard_0->second);
  const ContactSide& first = contact.sides[swapped ? 1 : 0];
  const ContactSide& other = contact.sides[swapped ? 0 : 1];
  Vector impulse = contact.impulse_on_first_newton_seconds;
  if (swapped) impulse = {-impulse[0], -impulse[1], -impulse[2]};

  v1::Contact& row = *step.add_contacts();
  row.set_object(swapped ? heard_1->second : heard_0->second);
  row.set_partner(PartnerNumber(other.body));
  Set(*row.mutable_point_m(), first.point_m);
  Set(*row.mutable_impulse_newton_seconds(), Rotate(Inverse(first.orientation), impulse));
  Set(*row.mutable_normal(), Rotate(Inverse(first.orientation), contact.normal));
  if (settings_.duration_s) row.set_duration_s(*settings_.duration_s);
  row.mutable_roughness()->set_travel_speed_m_per_s(TravelSpeed(contact));
  row.mutable_roughness()->set_depth(settings_.roughness_depth);
  row.mutable_roughness()->set_irregularity_length_m(settings_.irregularity_length_m);
  if (!has_0 || !has_1) return Describe(other, *row.mutable_hertz());
  v1::SecondObject& second = *row.mutable_second();
  second.set_object(swapped ? heard_0->second : heard_1->second);
  Set(*second.mutable_point_m(), other.point_m);
  Set(*second.mutable_rotation(), Times(Inverse(other.orientation), first.orientation));
}

void ContactRows::Describe(const ContactSide& silent, v1::HertzContact& hertz) const {
  // A striker of this mass changes the reduced mass of no real body, and one of this radius is
  // flat.
  constexpr double kImmovableMass_kg = 1e6, kFlatRadius_m = 1;
  hertz.set_striker(settings_.striker);
  hertz.set_striker_mass_kg(silent.mass_kg.value_or(kImmovableMass_kg));
  if (!silent.mass_kg) hertz.set_striker_radius_m(kFlatRadius_m);
}

void ContactRows::AppendPose(const void* body, const Vector& position_m,
                             const Quaternion& orientation, v1::ContactStep& step) const {
  v1::PoseColumns& poses = *step.mutable_poses();
  poses.add_object(handles_.at(body));
  for (const double x : position_m) poses.add_position_m(x);
  for (const double x : orientation) poses.add_orientation(static_cast<float>(x));
}

}  // namespace carillon::adapters
