// SPDX-License-Identifier: Apache-2.0
#include "server/api/contact_conversion.h"

#include <optional>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/api/column_conversion.h"
#include "server/api/pose_conversion.h"

namespace carillon {
namespace {

Point ToArray(const v1::Vec3& vector) { return {vector.x(), vector.y(), vector.z()}; }

SurfacePoint ToSurfacePoint(const v1::SurfacePoint& point) {
  return {.triangle = point.triangle(),
          .weights = {1 - point.weight1() - point.weight2(), point.weight1(), point.weight2()}};
}

/// Where a row's contact acts.
template <typename Row>
absl::StatusOr<std::variant<Point, SurfacePoint>> FromLocation(const Row& row) {
  if (row.has_point_m()) return ToArray(row.point_m());
  if (row.has_surface_point()) return ToSurfacePoint(row.surface_point());
  return Refusal(
      absl::StatusCode::kInvalidArgument, "LOCATION_MISSING",
      absl::StrCat("a contact on object ", row.object(), " has neither point_m nor surface_point"));
}

/// What all kinds of contacts have.
struct CommonContact {
  ContactImpulse impulse;
  std::optional<SecondObject> second;
};

template <typename Row>
absl::StatusOr<CommonContact> FromCommon(const Row& row, const v1::Vec3& vector) {
  const auto location = FromLocation(row);
  if (!location.ok()) return location.status();
  CommonContact contact;
  contact.impulse.location = *location;
  contact.impulse.impulse_newton_seconds = ToArray(vector);
  if (!row.has_second()) return contact;
  const auto second = FromLocation(row.second());
  if (!second.ok()) return second.status();
  contact.second = {.handle = row.second().object(), .location = *second};
  if (row.second().has_rotation()) contact.second->rotation = FromProto(row.second().rotation());
  return contact;
}

HertzContact FromProto(const v1::HertzContact& hertz) {
  return {.reduced_mass_kg = hertz.reduced_mass_kg(),
          .reduced_radius_m = hertz.reduced_radius_m(),
          .approach_speed_m_per_s = hertz.approach_speed_m_per_s(),
          .striker_young_pa = hertz.striker_young_pa(),
          .striker_poisson_ratio = hertz.striker_poisson_ratio()};
}

Roughness FromProto(const v1::Roughness& proto) {
  Roughness roughness;
  roughness.travel_speed_m_per_s = proto.travel_speed_m_per_s();
  roughness.depth = proto.depth();
  if (proto.grain_m() != 0) roughness.grain_m = proto.grain_m();
  return roughness;
}

absl::StatusOr<ObjectImpulse> FromRow(const v1::Impulse& row) {
  absl::StatusOr<CommonContact> contact = FromCommon(row, row.impulse_newton_seconds());
  if (!contact.ok()) return contact.status();
  contact->impulse.duration_s = row.duration_s();
  if (row.has_hertz()) contact->impulse.hertz = FromProto(row.hertz());
  return ObjectImpulse{.handle = row.object(),
                       .time_offset_s = row.time_offset_s(),
                       .impulse = contact->impulse,
                       .second = contact->second};
}

absl::StatusOr<ObjectForce> FromRow(const v1::SustainedContact& row) {
  const absl::StatusOr<CommonContact> contact = FromCommon(row, row.force_newtons());
  if (!contact.ok()) return contact.status();
  return ObjectForce{.handle = row.object(),
                     .force = contact->impulse,
                     .roughness = FromProto(row.roughness()),
                     .second = contact->second};
}

absl::StatusOr<ObjectTouch> FromRow(const v1::EngineContact& row) {
  absl::StatusOr<CommonContact> contact = FromCommon(row, row.impulse_newton_seconds());
  if (!contact.ok()) return contact.status();
  contact->impulse.duration_s = row.duration_s();
  return ObjectTouch{.handle = row.object(),
                     .partner = row.partner(),
                     .impulse = contact->impulse,
                     .roughness = FromProto(row.roughness()),
                     .second = contact->second};
}

template <typename Rows, typename Use>
void ForEachRow(const Rows& rows, const Use& use, const ContactSink& sink) {
  for (const auto& row : rows) {
    if (const auto contact = FromRow(row); contact.ok()) {
      use(*contact);
    } else {
      sink.reject(row.has_second() ? 2 : 1, contact.status());
    }
  }
}

}  // namespace

void ReadStep(const v1::ContactStep& step, const ContactSink& sink) {
  for (const v1::ObjectPose& row : step.poses()) sink.move(row.object(), FromProto(row.pose()));
  ReadColumns(step.pose_columns(), sink);
  if (step.has_listener()) sink.move_listener(FromProto(step.listener()));
  ForEachRow(step.impulses(), sink.strike, sink);
  ReadColumns(step.columns(), sink);
  ForEachRow(step.sustained(), sink.hold, sink);
  ForEachRow(step.contacts(), sink.touch, sink);
}

}  // namespace carillon
