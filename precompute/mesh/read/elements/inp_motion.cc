// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/inp_motion.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {

Point InpMotion::Apply(const Point& p) const {
  return {Dot(rotation[0], p) + shift[0], Dot(rotation[1], p) + shift[1],
          Dot(rotation[2], p) + shift[2]};
}

void InpMotion::Turn(const Point& a, const Point& b, double angle_deg) {
  const Point along = Difference(b, a);
  const double length = Norm(along);
  const Point axis = {along[0] / length, along[1] / length, along[2] / length};
  const double angle = angle_deg * std::numbers::pi / 180;
  // Rodrigues' formula, for each column of the rotation and for the shift.
  const auto turned = [&](const Point& p) {
    const Point cross = Cross(axis, p);
    Point result;
    for (size_t x = 0; x < 3; ++x) {
      result[x] = std::cos(angle) * p[x] + std::sin(angle) * cross[x] +
                  (1 - std::cos(angle)) * Dot(axis, p) * axis[x];
    }
    return result;
  };
  std::array<Point, 3> rows{};
  for (size_t column = 0; column < 3; ++column) {
    const Point image = turned({rotation[0][column], rotation[1][column], rotation[2][column]});
    for (size_t x = 0; x < 3; ++x) rows[x][column] = image[x];
  }
  rotation = rows;
  const Point moved = turned(Difference(shift, a));
  for (size_t x = 0; x < 3; ++x) shift[x] = a[x] + moved[x];
}

bool InpSystem::TakeLine(std::vector<double> values, int line) {
  const bool is_shift = line == 1 && values.size() <= 3;
  values.resize(6);
  const Point first = {values[0], values[1], values[2]};
  if (line == 1) {
    motion_ = {.shift = first};
    if (is_shift) return true;
    first_axis_ = Difference({values[3], values[4], values[5]}, first);
    return SetAxes({first_axis_[0], first_axis_[1], 0}, {-first_axis_[1], first_axis_[0], 0});
  }
  return line == 2 && SetAxes(first_axis_, Difference(first, motion_.shift));
}

bool InpSystem::SetAxes(const Point& first, const Point& beside) {
  const Point third = Cross(first, beside), second = Cross(third, first);
  if (!(Norm(third) > 0)) return false;
  const std::array<Point, 3> axes = {first, second, third};
  for (size_t x = 0; x < 3; ++x) {
    for (size_t axis = 0; axis < 3; ++axis) {
      motion_.rotation[x][axis] = axes[axis][x] / Norm(axes[axis]);
    }
  }
  return true;
}

Point FromCylindrical(const Point& p) {
  const double angle = p[1] * std::numbers::pi / 180;
  return {p[0] * std::cos(angle), p[0] * std::sin(angle), p[2]};
}

}  // namespace carillon::precompute
