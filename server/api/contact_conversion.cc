// SPDX-License-Identifier: Apache-2.0
#include "server/api/contact_conversion.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"

namespace carillon {
namespace {

Point ToArray(const v1::Vec3& vector) { return {vector.x(), vector.y(), vector.z()}; }

Point ToArray(const google::protobuf::RepeatedField<float>& column, int row) {
  return {column[3 * row], column[3 * row + 1], column[3 * row + 2]};
}

SurfacePoint ToSurfacePoint(const v1::SurfacePoint& point) {
  return {.triangle = point.triangle(),
          .weights = {1 - point.weight1() - point.weight2(), point.weight1(), point.weight2()}};
}

absl::StatusOr<ObjectImpulse> FromRow(const v1::Impulse& row) {
  ObjectImpulse impulse;
  impulse.handle = row.object();
  impulse.time_offset_s = row.time_offset_s();
  impulse.impulse.impulse_newton_seconds = ToArray(row.impulse_newton_seconds());
  impulse.impulse.duration_s = row.duration_s();
  if (row.has_point_m()) {
    impulse.impulse.location = ToArray(row.point_m());
  } else if (row.has_surface_point()) {
    impulse.impulse.location = ToSurfacePoint(row.surface_point());
  } else {
    return Refusal(absl::StatusCode::kInvalidArgument, "LOCATION_MISSING",
                   absl::StrCat("an impulse on object ", row.object(),
                                " has neither point_m nor surface_point"));
  }
  return impulse;
}

ObjectImpulse FromColumns(const v1::ImpulseColumns& columns, int row) {
  return {.handle = columns.object(row),
          .time_offset_s = columns.time_offset_s().empty() ? 0 : columns.time_offset_s(row),
          .impulse = {.location = ToArray(columns.point_m(), row),
                      .impulse_newton_seconds = ToArray(columns.impulse_newton_seconds(), row),
                      .duration_s = columns.duration_s().empty() ? 0 : columns.duration_s(row)}};
}

absl::Status CheckColumns(const v1::ImpulseColumns& columns) {
  const int count = columns.object_size();
  const auto fits = [count](int size) { return size == 0 || size == count; };
  if (columns.point_m_size() == 3 * count && columns.impulse_newton_seconds_size() == 3 * count &&
      fits(columns.duration_s_size()) && fits(columns.time_offset_s_size())) {
    return absl::OkStatus();
  }
  return Refusal(
      absl::StatusCode::kInvalidArgument, "COLUMNS_MISMATCHED",
      absl::StrCat("the columns have ", count, " objects, ", columns.point_m_size(),
                   " coordinates, ", columns.impulse_newton_seconds_size(), " impulse components, ",
                   columns.duration_s_size(), " durations and ", columns.time_offset_s_size(),
                   " offsets; n objects need 3 n, 3 n, n or none, n or none"));
}

}  // namespace

void ForEachImpulse(const v1::ContactStep& step, absl::FunctionRef<void(const ObjectImpulse&)> use,
                    absl::FunctionRef<void(uint64_t, absl::Status)> reject) {
  for (const v1::Impulse& row : step.impulses()) {
    if (absl::StatusOr<ObjectImpulse> impulse = FromRow(row); impulse.ok()) {
      use(*impulse);
    } else {
      reject(1, impulse.status());
    }
  }
  const v1::ImpulseColumns& columns = step.columns();
  if (absl::Status status = CheckColumns(columns); !status.ok()) {
    reject(static_cast<uint64_t>(std::max(1, columns.object_size())), std::move(status));
    return;
  }
  for (int row = 0; row < columns.object_size(); ++row) use(FromColumns(columns, row));
}

}  // namespace carillon
