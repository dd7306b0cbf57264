// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/c/c_conversion.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::c {
namespace {

/// The fewest digits that give the number back: plain from 1e-4 to 1e16, otherwise as "1.5e-7".
std::string Digits(double value) {
  if (value == 0) return "0";
  const double size = std::abs(value);
  const bool plain = size >= 1e-4 && size < 1e16;
  std::array<char, 64> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 plain ? std::chars_format::fixed : std::chars_format::scientific)
                       .ptr;
  std::string digits(text.data(), end);
  // to_chars writes at least two digits of an exponent.
  const size_t sign = digits.find_first_of("+-", digits.find('e') + 1);
  if (!plain && digits[sign + 1] == '0') digits.erase(sign + 1, 1);
  return digits;
}

void Set(const carillon_vec3& from, v1::Vec3& to) {
  to.set_x(from.x);
  to.set_y(from.y);
  to.set_z(from.z);
}

/// Errors: InvalidArgument (INVALID_SETTINGS: no such kind).
absl::StatusOr<v1::ContactKind> ToKind(carillon_contact_kind kind) {
  if (kind == CARILLON_CONTACT_REPORTED) return v1::CONTACT_KIND_REPORTED;
  if (kind == CARILLON_CONTACT_IMPACT) return v1::CONTACT_KIND_IMPACT;
  if (kind == CARILLON_CONTACT_FORCE) return v1::CONTACT_KIND_FORCE;
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("the kind of a contact is ", kind,
                              ": give CARILLON_CONTACT_REPORTED, _IMPACT or _FORCE"));
}

bool IsZero(const carillon_vec3& vector) { return vector.x == 0 && vector.y == 0 && vector.z == 0; }

/// Errors: InvalidArgument (INVALID_SETTINGS: an unknown kind, or the vector of another kind).
absl::Status Set(const carillon_contact& from, v1::Contact& to) {
  ASSIGN_OR_RETURN(const v1::ContactKind kind, ToKind(from.kind));
  const bool is_force = kind == v1::CONTACT_KIND_FORCE;
  if (!IsZero(is_force ? from.impulse_newton_seconds : from.force_newtons)) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   is_force ? "a contact force has impulse_newton_seconds; give force_newtons"
                            : "a contact with force_newtons is of another kind; give it the kind "
                              "CARILLON_CONTACT_FORCE, or impulse_newton_seconds");
  }
  to.set_kind(kind);
  to.set_object(from.object);
  Set(from.point_m, *to.mutable_point_m());
  if (is_force) {
    Set(from.force_newtons, *to.mutable_force_newtons());
  } else {
    Set(from.impulse_newton_seconds, *to.mutable_impulse_newton_seconds());
  }
  to.set_partner(from.partner);
  if (from.duration_s != 0) to.set_duration_s(from.duration_s);
  const carillon_vec3& normal = from.normal;
  if (normal.x != 0 || normal.y != 0 || normal.z != 0) Set(normal, *to.mutable_normal());
  if (from.travel_speed_m_per_s == 0) return absl::OkStatus();
  to.mutable_roughness()->set_travel_speed_m_per_s(from.travel_speed_m_per_s);
  to.mutable_roughness()->set_depth(from.roughness_depth);
  return absl::OkStatus();
}

void Append(const carillon_pose& from, v1::PoseColumns& to) {
  to.add_object(from.object);
  for (const double x : {from.position_m.x, from.position_m.y, from.position_m.z}) {
    to.add_position_m(x);
  }
  const carillon_quaternion& turn = from.orientation;
  for (const double x : {turn.w, turn.x, turn.y, turn.z}) {
    to.add_orientation(static_cast<float>(x));
  }
}

}  // namespace

v1::Pose ToPose(const carillon_pose& from) {
  v1::Pose pose;
  Set(from.position_m, *pose.mutable_position_m());
  const carillon_quaternion& turn = from.orientation;
  if (turn.w == 0 && turn.x == 0 && turn.y == 0 && turn.z == 0) return pose;
  v1::Quaternion& orientation = *pose.mutable_orientation();
  orientation.set_w(turn.w);
  orientation.set_x(turn.x);
  orientation.set_y(turn.y);
  orientation.set_z(turn.z);
  return pose;
}

v1::Hearing ToHearing(const carillon_hearing& from) {
  v1::Hearing hearing;
  hearing.set_distance_gain(from.distance_gain != 0);
  hearing.set_propagation_delay(from.propagation_delay != 0);
  hearing.set_panning(from.panning != 0);
  hearing.set_directivity(from.directivity != 0);
  hearing.set_near_field(from.near_field != 0);
  hearing.set_binaural(from.binaural != 0);
  hearing.set_reference_distance_m(from.reference_distance_m);
  hearing.set_sound_speed_m_per_s(from.sound_speed_m_per_s);
  return hearing;
}

absl::StatusOr<v1::Frame> ToFrame(carillon_frame frame) {
  if (frame == CARILLON_FRAME_OBJECT) return v1::FRAME_OBJECT;
  if (frame == CARILLON_FRAME_SCENE) return v1::FRAME_SCENE;
  return Refusal(
      absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
      absl::StrCat("the frame is ", frame, ": give CARILLON_FRAME_OBJECT or CARILLON_FRAME_SCENE"));
}

absl::Status CheckStep(double step_s) {
  if (step_s >= 1e-6 && step_s <= 1) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                 absl::StrCat("step_s is ", step_s,
                              "; say the simulator's step, from 1e-6 to 1 s (1/240 is 0 in C, "
                              "1.0/240 is not)"));
}

absl::StatusOr<std::string> MakeObj(std::span<const double> vertices_m,
                                    std::span<const uint32_t> triangles) {
  const size_t vertex_count = vertices_m.size() / 3;
  if (std::ranges::any_of(triangles, [&](uint32_t corner) { return corner >= vertex_count; })) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
                   absl::StrCat("a triangle names a vertex outside 0 to ", vertex_count,
                                " - 1; indices count from zero"));
  }
  std::string text;
  for (size_t i = 0; i < vertices_m.size(); i += 3) {
    absl::StrAppend(&text, "v ", Digits(vertices_m[i]), " ", Digits(vertices_m[i + 1]), " ",
                    Digits(vertices_m[i + 2]), "\n");
  }
  for (size_t i = 0; i < triangles.size(); i += 3) {
    absl::StrAppend(&text, "f ", triangles[i] + 1, " ", triangles[i + 1] + 1, " ",
                    triangles[i + 2] + 1, "\n");
  }
  return text;
}

absl::StatusOr<v1::ContactStep> ToStep(const carillon_step& step) {
  if ((step.contacts == nullptr && step.contact_count > 0) ||
      (step.poses == nullptr && step.pose_count > 0)) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "an array of the step is a null pointer, and its count is above zero");
  }
  v1::ContactStep made;
  made.set_time_s(step.time_s);
  if (step.time_scale != 0) made.set_time_scale(std::max(step.time_scale, 0.0));
  for (const carillon_contact& contact : std::span(step.contacts, step.contact_count)) {
    RETURN_IF_ERROR(Set(contact, *made.add_contacts()));
  }
  for (const carillon_pose& pose : std::span(step.poses, step.pose_count)) {
    Append(pose, *made.mutable_poses());
  }
  if (step.listener != nullptr) *made.mutable_listener() = ToPose(*step.listener);
  return made;
}

}  // namespace carillon::c
