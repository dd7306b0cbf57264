// SPDX-License-Identifier: Apache-2.0
#include "server/base/pose.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr double kFarthestM = 1e6;
constexpr double kUnitTolerance = 1e-3;

double Length(const Quaternion& q) {
  return std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
}

}  // namespace

absl::Status Validate(const Pose& pose) {
  for (const double coordinate : pose.position_m) {
    if (std::abs(coordinate) <= kFarthestM) continue;
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_POSE",
                   absl::StrCat("a coordinate of the position is ", coordinate,
                                "; it must be metres, within ", kFarthestM));
  }
  return Validate(pose.orientation);
}

absl::Status Validate(const Quaternion& rotation) {
  const double length = Length(rotation);
  if (std::abs(length - 1) <= kUnitTolerance) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_POSE",
                 absl::StrCat("a quaternion is of length ", length,
                              "; a rotation has length 1: divide w, x, y and z by it"));
}

Quaternion Normalized(const Quaternion& q) {
  const double length = Length(q);
  return {q.w / length, q.x / length, q.y / length, q.z / length};
}

Quaternion Inverse(const Quaternion& q) { return {q.w, -q.x, -q.y, -q.z}; }

Quaternion Product(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

Vector3 Rotated(const Vector3& v, const Quaternion& q) {
  const Quaternion turned = Product(Product(q, {0, v[0], v[1], v[2]}), Inverse(q));
  return {turned.x, turned.y, turned.z};
}

}  // namespace carillon
