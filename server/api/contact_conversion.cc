// SPDX-License-Identifier: Apache-2.0
#include "server/api/contact_conversion.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/column_conversion.h"
#include "server/api/pose_conversion.h"

namespace carillon {
namespace {

Point ToArray(const v1::Vec3& vector) { return {vector.x(), vector.y(), vector.z()}; }

SurfacePoint ToSurfacePoint(const v1::SurfacePoint& point) {
  return {.triangle = point.triangle(),
          .weights = {1 - point.weight1() - point.weight2(), point.weight1(), point.weight2()}};
}

/// Returns the location of a row's contact.
template <typename Row>
absl::StatusOr<std::variant<Point, SurfacePoint>> FromLocation(const Row& row) {
  if (row.has_point_m()) return ToArray(row.point_m());
  if (row.has_surface_point()) return ToSurfacePoint(row.surface_point());
  return Refusal(
      absl::StatusCode::kInvalidArgument, "LOCATION_MISSING",
      absl::StrCat("a contact on object ", row.object(), " has neither point_m nor surface_point"));
}

/// Fills in what all kinds of contacts have. `vector` is an impulse or a force.
template <typename Row>
absl::Status ReadContact(const Row& row, const v1::Vec3& vector, ObjectContact& contact) {
  ASSIGN_OR_RETURN(contact.impulse.location, FromLocation(row));
  contact.handle = row.object();
  contact.impulse.impulse_newton_seconds = ToArray(vector);
  if (!row.has_second()) return absl::OkStatus();
  SecondObject& second = contact.second.emplace();
  ASSIGN_OR_RETURN(second.location, FromLocation(row.second()));
  second.handle = row.second().object();
  if (row.second().has_rotation()) second.rotation = FromProto(row.second().rotation());
  return absl::OkStatus();
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

absl::Status ReadInto(const v1::Impulse& row, ObjectImpulse& impulse) {
  RETURN_IF_ERROR(ReadContact(row, row.impulse_newton_seconds(), impulse.contact));
  impulse.contact.impulse.duration_s = row.duration_s();
  if (row.has_hertz()) impulse.contact.impulse.hertz = FromProto(row.hertz());
  impulse.time_offset_s = row.time_offset_s();
  return absl::OkStatus();
}

absl::Status ReadInto(const v1::SustainedContact& row, ObjectForce& force) {
  RETURN_IF_ERROR(ReadContact(row, row.force_newtons(), force.contact));
  force.roughness = FromProto(row.roughness());
  return absl::OkStatus();
}

absl::Status ReadInto(const v1::EngineContact& row, ObjectTouch& touch) {
  RETURN_IF_ERROR(ReadContact(row, row.impulse_newton_seconds(), touch.contact));
  touch.contact.impulse.duration_s = row.duration_s();
  touch.partner = row.partner();
  touch.roughness = FromProto(row.roughness());
  return absl::OkStatus();
}

/// Gives each row to `take`, one of the intake's methods.
template <typename Contact, typename Rows>
void ReadRows(const Rows& rows, ContactIntake& intake,
              void (ContactIntake::*take)(const Contact&)) {
  for (const auto& row : rows) {
    Contact contact;
    if (absl::Status status = ReadInto(row, contact); status.ok()) {
      (intake.*take)(contact);
    } else {
      intake.Reject(row.has_second() ? 2 : 1, std::move(status));
    }
  }
}

void ReadColumns(const v1::ImpulseColumns& columns, ContactIntake& intake) {
  if (absl::Status status = Validate(columns); !status.ok()) {
    return intake.Reject(std::max<uint64_t>(1, CountContacts(columns)), std::move(status));
  }
  for (int row = 0; row < columns.object_size(); ++row) intake.Strike(ReadRow(columns, row));
}

void ReadColumns(const v1::PoseColumns& columns, ContactIntake& intake) {
  if (absl::Status status = Validate(columns); !status.ok()) {
    const auto count = static_cast<uint64_t>(columns.object_size());
    return intake.Reject(std::max<uint64_t>(1, count), std::move(status));
  }
  for (int row = 0; row < columns.object_size(); ++row) {
    intake.Move(columns.object(row), ReadRow(columns, row));
  }
}

}  // namespace

absl::Status ReadStep(const v1::ContactStep& step, ContactIntake& intake) {
  RETURN_IF_ERROR(intake.BeginStep(step.time_s()));
  for (const v1::ObjectPose& row : step.poses()) intake.Move(row.object(), FromProto(row.pose()));
  ReadColumns(step.pose_columns(), intake);
  if (step.has_listener()) intake.MoveListener(FromProto(step.listener()));
  ReadRows(step.impulses(), intake, &ContactIntake::Strike);
  ReadColumns(step.columns(), intake);
  ReadRows(step.sustained(), intake, &ContactIntake::Hold);
  ReadRows(step.contacts(), intake, &ContactIntake::Touch);
  intake.EndStep();
  return absl::OkStatus();
}

}  // namespace carillon
