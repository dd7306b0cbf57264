// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "server/base/pose.h"

namespace carillon {

inline double Length(const Vector3& v) { return std::hypot(v[0], v[1], v[2]); }

inline Vector3 Minus(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline double Dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace carillon
