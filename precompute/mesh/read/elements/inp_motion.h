// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A rigid motion: p becomes rotation * p + shift. The rotation is given by its rows.
struct InpMotion {
  std::array<Point, 3> rotation = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Point shift = {0, 0, 0};

  Point Apply(const Point& p) const;
  /// Adds a turn by `angle_deg` about the axis from `a` to `b`, which must not be equal.
  void Turn(const Point& a, const Point& b, double angle_deg);
};

/// The system in which nodes are given (*SYSTEM). Without lines it is that of the part.
class InpSystem {
 public:
  /// Takes line 1, the origin and a point on the first axis, or line 2, a point in the plane of the
  /// first and the second axis. Without the second line the third axis stays. Returns false if the
  /// points lie on one line.
  bool TakeLine(std::vector<double> values, int line);
  Point Apply(const Point& p) const { return motion_.Apply(p); }

 private:
  bool SetAxes(const Point& first, const Point& beside);

  InpMotion motion_;
  Point first_axis_{};
};

/// Returns the place of a point given by its radius, its angle in degrees and its height.
Point FromCylindrical(const Point& p);

}  // namespace carillon::precompute
