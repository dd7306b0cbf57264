// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/radiating_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <utility>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

SurfaceMesh WholeSurface(const SurfaceModes& modes) {
  SurfaceMesh whole;
  for (const auto& [x, y, z] : modes.vertices) whole.vertices.push_back({x, y, z});
  whole.triangles.assign(modes.triangles.begin(), modes.triangles.end());
  return whole;
}

/// Returns whether a shell is the wall of a void, whose normals point inwards, or lies within such
/// a wall.
bool IsEnclosed(const SurfaceMesh& whole, const Shell& shell, const std::vector<Shell>& shells) {
  if (shell.volume_m3 < 0) return true;
  return std::ranges::any_of(shells, [&](const Shell& other) {
    return other.volume_m3 < 0 && -other.volume_m3 > shell.volume_m3 &&
           std::abs(WindingNumber(whole, other, PointInside(whole, shell))) > 0.5;
  });
}

void SetSphere(RadiatingSurface& surface) {
  Point low = surface.mesh.vertices.front(), high = low;
  for (const Point& p : surface.mesh.vertices) {
    for (size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], p[a]);
      high[a] = std::max(high[a], p[a]);
    }
  }
  for (size_t a = 0; a < 3; ++a) surface.center[a] = (low[a] + high[a]) / 2;
  for (const Point& p : surface.mesh.vertices) {
    surface.radius_m = std::max(surface.radius_m, Distance(p, surface.center));
  }
}

/// Adds the integrals of f^2 and |grad f|^2 of some modes over one triangle.
void AddTriangle(const SurfaceModes& modes, const RadiatingSurface& surface, size_t t,
                 std::pair<size_t, size_t> part, std::span<double> energy,
                 std::span<double> slope) {
  const size_t count = modes.mode_count();
  const auto corner = CornersOf(surface.mesh, t);
  const Point area_normal = AreaNormal(corner);
  const double twice_area = Norm(area_normal);
  if (!(twice_area > 0)) return;
  std::array<const float*, 3> shape{};
  // |grad f|^2 is the sum of f_i f_j e_i . e_j / (2 A)^2 over the pairs of corners i, j.
  std::array<Point, 3> edge{};
  std::array<float, 3> normal{};
  for (size_t c = 0; c < 3; ++c) {
    const auto v = static_cast<size_t>(surface.mesh.triangles[t][c]);
    shape[c] = &modes.shapes[3 * count * static_cast<size_t>(surface.body_vertex[v])];
    edge[c] = Difference(corner[(c + 2) % 3], corner[(c + 1) % 3]);
    normal[c] = static_cast<float>(area_normal[c] / twice_area);
  }
  const auto area = static_cast<float>(twice_area / 2);
  std::array<float, 6> stiffness{};  // index pairs 00 11 22 01 12 20
  for (size_t c = 0; c < 3; ++c) {
    stiffness[c] = static_cast<float>(Dot(edge[c], edge[c]) / (2 * twice_area));
    stiffness[3 + c] = static_cast<float>(Dot(edge[c], edge[(c + 1) % 3]) / twice_area);
  }
  for (size_t m = part.first; m < part.second; ++m) {
    std::array<float, 3> f{};
    for (size_t c = 0; c < 3; ++c) {
      f[c] = normal[0] * shape[c][m] + normal[1] * shape[c][count + m] +
             normal[2] * shape[c][2 * count + m];
    }
    const float sum = f[0] + f[1] + f[2];
    energy[m] += area / 12 * (sum * sum + f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
    for (size_t c = 0; c < 3; ++c) {
      slope[m] += stiffness[c] * f[c] * f[c] + stiffness[3 + c] * f[c] * f[(c + 1) % 3];
    }
  }
}

}  // namespace

RadiatingSurface FindRadiatingSurface(const SurfaceModes& modes) {
  const SurfaceMesh whole = WholeSurface(modes);
  const std::vector<Shell> shells = FindShells(whole);
  RadiatingSurface surface;
  std::vector<int32_t> number(whole.vertices.size(), -1);
  for (const Shell& shell : shells) {
    if (IsEnclosed(whole, shell, shells)) continue;
    for (const int32_t t : shell.triangles) {
      auto& triangle = surface.mesh.triangles.emplace_back();
      for (size_t c = 0; c < 3; ++c) {
        const int32_t v = whole.triangles[static_cast<size_t>(t)][c];
        int32_t& own = number[static_cast<size_t>(v)];
        if (own < 0) {
          own = static_cast<int32_t>(surface.mesh.vertices.size());
          surface.mesh.vertices.push_back(whole.vertices[static_cast<size_t>(v)]);
          surface.body_vertex.push_back(v);
        }
        triangle[c] = own;
      }
    }
  }
  SetSphere(surface);
  return surface;
}

std::vector<NormalMotion> NormalMotions(const SurfaceModes& modes, const RadiatingSurface& surface,
                                        Workers& workers) {
  const size_t count = modes.mode_count();
  std::vector<double> energy(count), slope(count);
  workers.ForParts(static_cast<int64_t>(count), 16, [&](int64_t begin, int64_t end, int) {
    for (size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
      AddTriangle(modes, surface, t, {begin, end}, energy, slope);
    }
  });
  std::vector<NormalMotion> motions(count);
  for (size_t m = 0; m < count; ++m) {
    motions[m] = {.energy = energy[m],
                  .wavelength_m = 2 * std::numbers::pi * std::sqrt(2 * energy[m] / slope[m])};
  }
  return motions;
}

}  // namespace carillon::precompute
