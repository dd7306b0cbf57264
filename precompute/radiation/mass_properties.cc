// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/mass_properties.h"

#include <cstddef>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// Integrals of 1, of x_a, and of x_a x_b over the volume.
struct Moments {
  double volume = 0;
  Point first{};
  std::array<std::array<double, 3>, 3> second{};
};

/// Adds the tetrahedron between the origin and a triangle. Its volume is positive if the triangle
/// is clockwise seen from the origin.
void AddTetrahedron(const std::array<Point, 3>& corner, Moments& sum) {
  const double volume = Dot(corner[0], Cross(corner[1], corner[2])) / 6;
  sum.volume += volume;
  Point whole{};
  for (const Point& p : corner) {
    for (size_t i = 0; i < 3; ++i) whole[i] += p[i];
  }
  for (size_t i = 0; i < 3; ++i) {
    sum.first[i] += volume / 4 * whole[i];
    for (size_t j = 0; j < 3; ++j) {
      double corners = whole[i] * whole[j];
      for (const Point& p : corner) corners += p[i] * p[j];
      sum.second[i][j] += volume / 20 * corners;
    }
  }
}

}  // namespace

MassProperties ComputeMassProperties(std::span<const std::array<float, 3>> vertices,
                                     std::span<const std::array<int32_t, 3>> triangles) {
  Moments sum;
  for (const auto& triangle : triangles) {
    std::array<Point, 3> corner{};
    for (size_t c = 0; c < 3; ++c) {
      const auto& v = vertices[static_cast<size_t>(triangle[c])];
      corner[c] = {v[0], v[1], v[2]};
    }
    AddTetrahedron(corner, sum);
  }
  MassProperties result{.volume_m3 = sum.volume};
  std::array<std::array<double, 3>, 3> centered = sum.second;
  for (size_t i = 0; i < 3; ++i) result.center_of_mass[i] = sum.first[i] / sum.volume;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      centered[i][j] -= sum.volume * result.center_of_mass[i] * result.center_of_mass[j];
    }
  }
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    const size_t k = (i + 2) % 3;
    result.inertia[i] = centered[j][j] + centered[k][k];
    result.inertia[3 + i] = -centered[i][j];
  }
  return result;
}

}  // namespace carillon::precompute
