// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/column_conversion.h"

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

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
    return Refusal(absl::StatusCode::kInvalidArgument, "COLUMNS_MISMATCHED",
                   absl::StrCat("the column ", column.name, " has ", column.size, " numbers for ",
                                column.row_count, " objects; it needs ", column.width, " for each",
                                column.may_be_empty ? ", or none at all" : ""));
  }
  return absl::OkStatus();
}

std::optional<SecondObject> ToSecond(const v1::ImpulseColumns& columns, int row) {
  if (columns.second_object().empty() || columns.second_object(row) == 0) return std::nullopt;
  return SecondObject{.handle = columns.second_object(row),
                      .location = ToArray(columns.second_point_m(), row),
                      .rotation = ToRotation(columns.second_rotation(), row)};
}

std::optional<double> ToDuration(const v1::ImpulseColumns& columns, int row) {
  if (columns.duration_s().empty() || columns.duration_s(row) < 0) return std::nullopt;
  return columns.duration_s(row);
}

double ToTimeOffset(const v1::ImpulseColumns& columns, int row) {
  return columns.time_offset_s().empty() ? 0 : columns.time_offset_s(row);
}

void ReadContact(const v1::ImpulseColumns& columns, int row, ObjectContact& contact) {
  contact.handle = columns.object(row);
  contact.impulse.location = ToArray(columns.point_m(), row);
  contact.impulse.impulse_newton_seconds = ToArray(columns.impulse_newton_seconds(), row);
  contact.impulse.duration_s = ToDuration(columns, row);
  contact.second = ToSecond(columns, row);
}

}  // namespace

absl::Status Validate(const v1::ImpulseColumns& columns) {
  const int count = columns.object_size();
  const int seconds = columns.second_object_size();
  return CheckSizes({{"point_m", columns.point_m_size(), count, 3},
                     {"impulse_newton_seconds", columns.impulse_newton_seconds_size(), count, 3},
                     {"duration_s", columns.duration_s_size(), count, 1, true},
                     {"time_offset_s", columns.time_offset_s_size(), count, 1, true},
                     {"second_object", seconds, count, 1, true},
                     {"second_point_m", columns.second_point_m_size(), seconds, 3},
                     {"second_rotation", columns.second_rotation_size(), seconds, 4, true}});
}

absl::Status Validate(const v1::EngineContactColumns& columns) {
  absl::Status status = Validate(columns.impulses());
  const int count = columns.impulses().object_size();
  status.Update(
      CheckSizes({{"partner", columns.partner_size(), count, 1, true},
                  {"travel_speed_m_per_s", columns.travel_speed_m_per_s_size(), count, 1, true}}));
  return status;
}

absl::Status Validate(const v1::PoseColumns& columns) {
  const int count = columns.object_size();
  return CheckSizes({{"position_m", columns.position_m_size(), count, 3},
                     {"orientation", columns.orientation_size(), count, 4, true}});
}

uint64_t CountContacts(const v1::ImpulseColumns& columns) {
  const auto& seconds = columns.second_object();
  const auto none = std::count(seconds.begin(), seconds.end(), 0U);
  return static_cast<uint64_t>(columns.object_size() + seconds.size() - none);
}

void ReadRow(const v1::ImpulseColumns& columns, int row, ObjectImpulse& impulse) {
  ReadContact(columns, row, impulse.contact);
  impulse.time_offset_s = ToTimeOffset(columns, row);
}

void ReadRow(const v1::EngineContactColumns& columns, int row, ObjectTouch& touch) {
  ReadContact(columns.impulses(), row, touch.contact);
  touch.time_offset_s = ToTimeOffset(columns.impulses(), row);
  touch.partner = columns.partner().empty() ? 0 : columns.partner(row);
  if (!columns.travel_speed_m_per_s().empty()) {
    touch.roughness.travel_speed_m_per_s = columns.travel_speed_m_per_s(row);
  }
  touch.roughness.depth = columns.depth();
  if (columns.irregularity_length_m() != 0) {
    touch.roughness.irregularity_length_m = columns.irregularity_length_m();
  }
}

Pose ReadRow(const v1::PoseColumns& columns, int row) {
  return {.position_m = ToArray(columns.position_m(), row),
          .orientation = ToRotation(columns.orientation(), row).value_or(Quaternion{})};
}

}  // namespace carillon
