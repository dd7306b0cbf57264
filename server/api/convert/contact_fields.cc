// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_fields.h"

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/hertz_contact_conversion.h"
#include "server/api/convert/pose_conversion.h"

namespace carillon {
namespace {

absl::Status Malformed(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "CONTACT_MALFORMED", message);
}

Point ToArray(const v1::Vec3& vector) { return {vector.x(), vector.y(), vector.z()}; }

SurfacePoint ToSurfacePoint(const v1::SurfacePoint& point) {
  return {.triangle = point.triangle(),
          .weights = {1 - point.weight1() - point.weight2(), point.weight1(), point.weight2()}};
}

/// Returns the location of a contact, or of its second object.
template <typename Row>
absl::StatusOr<std::variant<Point, SurfacePoint>> FromLocation(const Row& row) {
  if (row.has_point_m()) return ToArray(row.point_m());
  if (row.has_surface_point()) return ToSurfacePoint(row.surface_point());
  return Malformed(
      absl::StrCat("a contact on object ", row.object(), " has neither point_m nor surface_point"));
}

/// Returns the impulse or the force of a row.
absl::StatusOr<Vector3> VectorOf(const v1::Contact& row) {
  const bool is_force = row.kind() == v1::CONTACT_KIND_FORCE;
  if (is_force && row.has_force_newtons()) return ToArray(row.force_newtons());
  if (!is_force && row.has_impulse_newton_seconds()) return ToArray(row.impulse_newton_seconds());
  return Malformed(absl::StrCat("a contact on object ", row.object(), " of the kind ",
                                v1::ContactKind_Name(row.kind()), " has no ",
                                is_force ? "force_newtons" : "impulse_newton_seconds"));
}

/// Reads the duration of a contact, or the figures of the collision that determine the duration.
absl::Status ReadDuration(const v1::Contact& row, ContactImpulse& impulse) {
  if (row.has_duration_s()) {
    impulse.duration_s = row.duration_s();
  } else if (row.has_hertz()) {
    ASSIGN_OR_RETURN(impulse.hertz, ToHertzContact(row.hertz()));
  }
  return absl::OkStatus();
}

Roughness ToRoughness(double travel_speed_m_per_s, double depth, double irregularity_length_m) {
  Roughness roughness;
  roughness.travel_speed_m_per_s = travel_speed_m_per_s;
  roughness.depth = depth;
  if (irregularity_length_m != 0) roughness.irregularity_length_m = irregularity_length_m;
  return roughness;
}

/// Reads the fields that `target` has: an impact has no roughness, for example.
template <typename Target>
absl::Status ReadFields(const v1::Contact& row, Target& target) {
  ObjectContact& contact = target.contact;
  contact.handle = row.object();
  ASSIGN_OR_RETURN(contact.impulse.location, FromLocation(row));
  ASSIGN_OR_RETURN(contact.impulse.impulse_newton_seconds, VectorOf(row));
  if constexpr (requires { target.time_offset_s; }) {
    RETURN_IF_ERROR(ReadDuration(row, contact.impulse));
    contact.impulse.normal = ToArray(row.normal());
    target.time_offset_s = row.time_offset_s();
  }
  if constexpr (requires { target.partner; }) target.partner = row.partner();
  if constexpr (requires { target.roughness; }) {
    const v1::Roughness& rough = row.roughness();
    target.roughness =
        ToRoughness(rough.travel_speed_m_per_s(), rough.depth(), rough.irregularity_length_m());
  }
  if (!row.has_second()) return absl::OkStatus();
  SecondObject& second = contact.second.emplace();
  ASSIGN_OR_RETURN(second.location, FromLocation(row.second()));
  second.handle = row.second().object();
  if (row.second().has_rotation()) second.rotation = FromProto(row.second().rotation());
  return absl::OkStatus();
}

template <typename Number>
using Numbers = google::protobuf::RepeatedField<Number>;

template <typename Number>
Vector3 ToArray(const Numbers<Number>& column, int row) {
  return {column[3 * row], column[3 * row + 1], column[3 * row + 2]};
}

/// Returns a row's rotation, or nothing if all four numbers are zero or the column is empty.
std::optional<Quaternion> ToRotation(const Numbers<float>& column, int row) {
  if (column.empty()) return std::nullopt;
  const Quaternion q{column[4 * row], column[4 * row + 1], column[4 * row + 2],
                     column[4 * row + 3]};
  if (q.w == 0 && q.x == 0 && q.y == 0 && q.z == 0) return std::nullopt;
  return q;
}

std::optional<SecondObject> ToSecond(const v1::ContactColumns& columns, int row) {
  if (columns.second_object().empty() || columns.second_object(row) == 0) return std::nullopt;
  return SecondObject{.handle = columns.second_object(row),
                      .location = ToArray(columns.second_point_m(), row),
                      .rotation = ToRotation(columns.second_rotation(), row)};
}

std::optional<double> ToDuration(const v1::ContactColumns& columns, int row) {
  if (columns.duration_s().empty() || columns.duration_s(row) < 0) return std::nullopt;
  return columns.duration_s(row);
}

/// Returns a row's number, or zero if the column is empty.
template <typename Number>
Number ToNumber(const Numbers<Number>& column, int row) {
  return column.empty() ? 0 : column[row];
}

/// Reads the columns that `target` has a member for.
template <typename Target>
void ReadFields(const v1::ContactColumns& columns, int row, Target& target) {
  const auto& vectors = columns.kind() == v1::CONTACT_KIND_FORCE ? columns.force_newtons()
                                                                 : columns.impulse_newton_seconds();
  ObjectContact& contact = target.contact;
  contact.handle = columns.object(row);
  contact.impulse.location = ToArray(columns.point_m(), row);
  contact.impulse.impulse_newton_seconds = ToArray(vectors, row);
  contact.second = ToSecond(columns, row);
  if constexpr (requires { target.time_offset_s; }) {
    contact.impulse.duration_s = ToDuration(columns, row);
    if (!columns.normal().empty()) contact.impulse.normal = ToArray(columns.normal(), row);
    target.time_offset_s = ToNumber(columns.time_offset_s(), row);
  }
  if constexpr (requires { target.partner; }) target.partner = ToNumber(columns.partner(), row);
  if constexpr (requires { target.roughness; }) {
    target.roughness = ToRoughness(ToNumber(columns.travel_speed_m_per_s(), row),
                                   columns.roughness_depth(), columns.irregularity_length_m());
  }
}

absl::Status Mismatched(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "CONTACT_MALFORMED", message);
}

/// The size of a column, and the numbers from which its right size follows.
struct ColumnSize {
  absl::string_view name;
  int size = 0;
  int row_count = 0;
  int width = 1;  ///< numbers in a row
  bool may_be_empty = false;
};

absl::Status CheckSizes(std::initializer_list<ColumnSize> columns) {
  for (const ColumnSize& column : columns) {
    const bool left_out = column.may_be_empty && column.size == 0;
    if (left_out || column.size == column.width * column.row_count) continue;
    return Mismatched(absl::StrCat("the column ", column.name, " has ", column.size,
                                   " numbers for ", column.row_count, " objects; it needs ",
                                   column.width, " for each",
                                   column.may_be_empty ? ", or none at all" : ""));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<v1::ContactKind> KindOf(v1::ContactKind kind) {
  switch (kind) {
    case v1::CONTACT_KIND_UNSPECIFIED:
      return v1::CONTACT_KIND_REPORTED;
    case v1::CONTACT_KIND_REPORTED:
    case v1::CONTACT_KIND_IMPACT:
    case v1::CONTACT_KIND_FORCE:
      return kind;
    default:
      return Malformed(absl::StrCat("this daemon knows no kind ", static_cast<int>(kind),
                                    " of contacts; give one of ContactKind"));
  }
}

absl::Status ReadRow(const v1::Contact& row, ObjectImpulse& impact) {
  return ReadFields(row, impact);
}
absl::Status ReadRow(const v1::Contact& row, ObjectForce& force) { return ReadFields(row, force); }
absl::Status ReadRow(const v1::Contact& row, ObjectTouch& reported) {
  return ReadFields(row, reported);
}

absl::Status Validate(const v1::ContactColumns& columns) {
  const int count = columns.object_size();
  const int seconds = columns.second_object_size();
  const bool are_forces = columns.kind() == v1::CONTACT_KIND_FORCE;
  if ((are_forces ? columns.impulse_newton_seconds_size() : columns.force_newtons_size()) > 0) {
    return Mismatched(are_forces ? "contact forces have the column force_newtons, and not "
                                   "impulse_newton_seconds; give newtons there"
                                 : "contacts with impulses have the column "
                                   "impulse_newton_seconds, and not force_newtons; give newton "
                                   "seconds there, or the kind CONTACT_KIND_FORCE");
  }
  const ColumnSize vectors =
      are_forces
          ? ColumnSize{"force_newtons", columns.force_newtons_size(), count, 3}
          : ColumnSize{"impulse_newton_seconds", columns.impulse_newton_seconds_size(), count, 3};
  return CheckSizes({{"point_m", columns.point_m_size(), count, 3},
                     vectors,
                     {"duration_s", columns.duration_s_size(), count, 1, true},
                     {"time_offset_s", columns.time_offset_s_size(), count, 1, true},
                     {"partner", columns.partner_size(), count, 1, true},
                     {"travel_speed_m_per_s", columns.travel_speed_m_per_s_size(), count, 1, true},
                     {"second_object", seconds, count, 1, true},
                     {"second_point_m", columns.second_point_m_size(), seconds, 3},
                     {"second_rotation", columns.second_rotation_size(), seconds, 4, true},
                     {"normal", columns.normal_size(), count, 3, true}});
}

absl::Status Validate(const v1::PoseColumns& columns) {
  const int count = columns.object_size();
  return CheckSizes({{"position_m", columns.position_m_size(), count, 3},
                     {"orientation", columns.orientation_size(), count, 4, true}});
}

uint64_t CountContacts(const v1::ContactColumns& columns) {
  const auto& seconds = columns.second_object();
  const auto none = std::count(seconds.begin(), seconds.end(), 0U);
  return static_cast<uint64_t>(columns.object_size() + seconds.size() - none);
}

void ReadRow(const v1::ContactColumns& columns, int row, ObjectImpulse& impact) {
  ReadFields(columns, row, impact);
}
void ReadRow(const v1::ContactColumns& columns, int row, ObjectForce& force) {
  ReadFields(columns, row, force);
}
void ReadRow(const v1::ContactColumns& columns, int row, ObjectTouch& reported) {
  ReadFields(columns, row, reported);
}

Pose ReadRow(const v1::PoseColumns& columns, int row) {
  return {.position_m = ToArray(columns.position_m(), row),
          .orientation = ToRotation(columns.orientation(), row).value_or(Quaternion{})};
}

}  // namespace carillon
