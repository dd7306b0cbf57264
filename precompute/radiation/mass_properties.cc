// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/mass_properties.h"

#include <cstddef>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// The moments of FromMoments.
using Moments = std::array<double, 10>;

/// Adds the tetrahedron between the origin and a triangle. Its volume is positive if the triangle
/// is clockwise seen from the origin.
void AddTetrahedron(const std::array<Point, 3>& corner, Moments& sum) {
  const double volume = Dot(corner[0], Cross(corner[1], corner[2])) / 6;
  Point whole{};
  for (const Point& p : corner) {
    for (size_t i = 0; i < 3; ++i) whole[i] += p[i];
  }
  const auto second = [&](size_t i, size_t j) {
    double corners = whole[i] * whole[j];
    for (const Point& p : corner) corners += p[i] * p[j];
    return volume / 20 * corners;
  };
  sum[0] += volume;
  for (size_t i = 0; i < 3; ++i) {
    sum[1 + i] += volume / 4 * whole[i];
    sum[4 + i] += second(i, i);
    sum[7 + i] += second(i, (i + 1) % 3);
  }
}

}  // namespace

MassProperties FromMoments(std::span<const double, 10> moments) {
  const double mass = moments[0];
  MassProperties result{.volume_m3 = mass};
  for (size_t i = 0; i < 3; ++i) result.center_of_mass[i] = moments[1 + i] / mass;
  const Point& c = result.center_of_mass;
  const auto square = [&](size_t i) { return moments[4 + i] - mass * c[i] * c[i]; };
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    result.inertia[i] = square(j) + square((i + 2) % 3);
    result.inertia[3 + i] = mass * c[i] * c[j] - moments[7 + i];
  }
  return result;
}

MassProperties ComputeMassProperties(std::span<const std::array<float, 3>> vertices,
                                     std::span<const std::array<int32_t, 3>> triangles) {
  Moments sum{};
  for (const auto& triangle : triangles) {
    std::array<Point, 3> corner{};
    for (size_t c = 0; c < 3; ++c) {
      const auto& v = vertices[static_cast<size_t>(triangle[c])];
      corner[c] = {v[0], v[1], v[2]};
    }
    AddTetrahedron(corner, sum);
  }
  return FromMoments(sum);
}

}  // namespace carillon::precompute
