// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carillon {

double AreaM2(std::span<const std::array<float, 3>> vertices,
              std::span<const std::array<uint32_t, 3>> triangles) {
  double sum = 0;
  for (const std::array<uint32_t, 3>& triangle : triangles) {
    std::array<std::array<double, 3>, 2> edges{};
    for (size_t i = 0; i < 3; ++i) {
      edges[0][i] = double{vertices[triangle[1]][i]} - double{vertices[triangle[0]][i]};
      edges[1][i] = double{vertices[triangle[2]][i]} - double{vertices[triangle[0]][i]};
    }
    const auto& [a, b] = edges;
    sum += std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                      a[0] * b[1] - a[1] * b[0]) /
           2;
  }
  return sum;
}

namespace {

/// Calls `take` with six times the signed volume of each triangle's tetrahedron, and with the
/// corners of the triangle and their sum. The tetrahedra stand on a vertex of the surface, because
/// rounding errors are smallest there; that vertex is the origin.
template <typename Take>
void ForEachTetrahedron(std::span<const std::array<float, 3>> vertices,
                        std::span<const std::array<uint32_t, 3>> triangles, const Take& take) {
  if (triangles.empty()) return;
  const std::array<float, 3>& origin = vertices[triangles[0][0]];
  const auto from_origin = [&](uint32_t vertex) {
    std::array<double, 3> v{};
    for (size_t i = 0; i < 3; ++i) v[i] = double{vertices[vertex][i]} - double{origin[i]};
    return v;
  };
  for (const std::array<uint32_t, 3>& triangle : triangles) {
    const auto a = from_origin(triangle[0]), b = from_origin(triangle[1]),
               c = from_origin(triangle[2]);
    take(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]),
         std::array<std::array<double, 3>, 4>{
             {a, b, c, {a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]}}});
  }
}

}  // namespace

double VolumeM3(std::span<const std::array<float, 3>> vertices,
                std::span<const std::array<uint32_t, 3>> triangles) {
  double sum = 0;
  ForEachTetrahedron(vertices, triangles,
                     [&sum](double six_volumes, const auto&) { sum += six_volumes; });
  return std::abs(sum) / 6;
}

std::array<double, 3> CentreM(std::span<const std::array<float, 3>> vertices,
                              std::span<const std::array<uint32_t, 3>> triangles) {
  double sum = 0;
  std::array<double, 3> moment{}, centre{};
  ForEachTetrahedron(vertices, triangles, [&](double six_volumes, const auto& corners) {
    sum += six_volumes;
    for (size_t i = 0; i < 3; ++i) moment[i] += six_volumes * corners[3][i] / 4;
  });
  for (size_t i = 0; i < 3; ++i) {
    if (sum != 0) {
      centre[i] = double{vertices[triangles[0][0]][i]} + moment[i] / sum;
      continue;
    }
    for (const auto& vertex : vertices) {
      centre[i] += double{vertex[i]} / static_cast<double>(vertices.size());
    }
  }
  return centre;
}

std::array<std::array<double, 3>, 3> InertiaM5(std::span<const std::array<float, 3>> vertices,
                                               std::span<const std::array<uint32_t, 3>> triangles) {
  // The integrals of 1, x_i and x_i x_j over the body.
  double volume = 0;
  std::array<double, 3> moment{};
  std::array<std::array<double, 3>, 3> second{}, inertia{};
  ForEachTetrahedron(vertices, triangles, [&](double six_volumes, const auto& corners) {
    volume += six_volumes / 6;
    for (size_t i = 0; i < 3; ++i) {
      moment[i] += six_volumes / 24 * corners[3][i];
      for (size_t j = 0; j < 3; ++j) {
        for (const auto& corner : corners)
          second[i][j] += six_volumes / 120 * corner[i] * corner[j];
      }
    }
  });
  if (volume == 0) return inertia;
  const double sign = volume > 0 ? 1 : -1;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      const double about_centre = sign * (second[i][j] - moment[i] * moment[j] / volume);
      inertia[i][j] -= about_centre;
      if (i != j) continue;
      for (size_t k = 0; k < 3; ++k) inertia[k][k] += about_centre;
    }
  }
  return inertia;
}

double ExtentM(std::span<const std::array<float, 3>> vertices) {
  double square = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const std::array<float, 3>& vertex : vertices) {
      least = std::min(least, double{vertex[axis]});
      most = std::max(most, double{vertex[axis]});
    }
    if (most > least) square += (most - least) * (most - least);
  }
  return std::sqrt(square);
}

}  // namespace carillon
