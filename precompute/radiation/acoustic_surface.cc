// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/acoustic_surface.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

Point Scaled(const Point& p, double factor) {
  return {factor * p[0], factor * p[1], factor * p[2]};
}

void Add(const Point& p, Point& sum) {
  for (size_t a = 0; a < 3; ++a) sum[a] += p[a];
}

/// Returns the edge opposite to corner `c`, in the direction in which the triangle's corners are
/// ordered.
std::array<float, 3> OppositeEdge(const AcousticSurface& surface, size_t t, size_t c) {
  const auto corner = CornersOf(surface.mesh, t);
  const Point edge = Difference(corner[(c + 2) % 3], corner[(c + 1) % 3]);
  return {static_cast<float>(edge[0]), static_cast<float>(edge[1]), static_cast<float>(edge[2])};
}

}  // namespace

AcousticSurface MakeAcousticSurface(SurfaceMesh mesh) {
  AcousticSurface surface{.mesh = std::move(mesh),
                          .areas = {},
                          .area_vectors = {},
                          .triangle_area_vectors = {},
                          .mean_edge_m = 0};
  surface.areas.assign(surface.vertex_count(), 0);
  surface.area_vectors.assign(surface.vertex_count(), {0, 0, 0});
  double edges_m = 0;
  for (size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
    const auto corner = CornersOf(surface.mesh, t);
    const Point normal = Scaled(AreaNormal(corner), 0.5);
    surface.triangle_area_vectors.push_back(normal);
    for (size_t c = 0; c < 3; ++c) {
      const auto v = static_cast<size_t>(surface.mesh.triangles[t][c]);
      surface.areas[v] += Norm(normal) / 3;
      Add(Scaled(normal, 1.0 / 3), surface.area_vectors[v]);
      edges_m += Distance(corner[c], corner[(c + 1) % 3]);
    }
  }
  const size_t sides = std::max<size_t>(1, 3 * surface.mesh.triangles.size());
  surface.mean_edge_m = edges_m / static_cast<double>(sides);
  return surface;
}

Point CurlOfHat(const AcousticSurface& surface, size_t t, size_t c) {
  const auto corner = CornersOf(surface.mesh, t);
  const Point edge = Difference(corner[(c + 2) % 3], corner[(c + 1) % 3]);
  return Scaled(edge, 0.5 / Norm(surface.triangle_area_vectors[t]));
}

void LumpedCurls(const AcousticSurface& surface, std::span<const ComplexFloat> p,
                 std::span<std::array<ComplexFloat, 3>> curls) {
  std::ranges::fill(curls, std::array<ComplexFloat, 3>{});
  for (size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
    const auto& triangle = surface.mesh.triangles[t];
    std::array<ComplexFloat, 3> sum{};
    for (size_t c = 0; c < 3; ++c) {
      const std::array<float, 3> edge = OppositeEdge(surface, t, c);
      const ComplexFloat value = p[static_cast<size_t>(triangle[c])] / 6.0F;
      for (size_t a = 0; a < 3; ++a) sum[a] += edge[a] * value;
    }
    for (const int32_t v : triangle) {
      for (size_t a = 0; a < 3; ++a) curls[static_cast<size_t>(v)][a] += sum[a];
    }
  }
}

void AddCurlTests(const AcousticSurface& surface,
                  std::span<const std::array<ComplexFloat, 3>> field, ComplexFloat factor,
                  std::span<ComplexFloat> result) {
  for (size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
    const auto& triangle = surface.mesh.triangles[t];
    std::array<ComplexFloat, 3> sum{};
    for (const int32_t v : triangle) {
      for (size_t a = 0; a < 3; ++a) sum[a] += field[static_cast<size_t>(v)][a];
    }
    for (size_t c = 0; c < 3; ++c) {
      const std::array<float, 3> edge = OppositeEdge(surface, t, c);
      const ComplexFloat value = (edge[0] * sum[0] + edge[1] * sum[1] + edge[2] * sum[2]) / 6.0F;
      result[static_cast<size_t>(triangle[c])] += factor * value;
    }
  }
}

}  // namespace carillon::precompute
