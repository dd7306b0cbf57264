// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The potentials of a plane triangle with a linear density at a point. There is one number for the
/// hat function of each corner.
struct TrianglePotentials {
  std::array<double, 3> single;   ///< integral of hat / r, m
  std::array<double, 3> doubled;  ///< integral of hat d(1/r)/dn', where n' is the triangle's normal
};

/// Computes the potentials of one triangle in closed form (Wilton et al., IEEE Trans. Antennas
/// Propag. 32, 1984; Graglia, ibid. 41, 1993). The triangle must have an area.
class TrianglePotential {
 public:
  explicit TrianglePotential(const std::array<Point, 3>& corner);

  /// Returns the potentials at `x`, which may lie on the triangle but not on an edge. In the plane
  /// of the triangle, the double layer is zero, the mean of its values on both sides.
  TrianglePotentials At(const Point& x) const;

 private:
  /// Returns the solid angle of the triangle seen from x, without a sign (van Oosterom and Strackee
  /// 1983).
  double SolidAngle(const Point& x) const;

  struct Edge {
    Point from;
    Point along;    ///< of length one
    Point outward;  ///< in the plane, of length one
    double length_m;
  };
  std::array<Edge, 3> edges_;      ///< edge e faces corner e
  std::array<Point, 3> gradient_;  ///< of the hat functions, 1/m
  std::array<Point, 3> corner_;
  Point normal_;
};

}  // namespace carillon::precompute
