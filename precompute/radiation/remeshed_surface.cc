// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/remeshed_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/remesh_surface.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// An edge between faces whose normals differ by a larger angle is an edge of the body, not one
/// between facets of a round surface. A surface that cuts off edges of the body radiates too
/// little.
constexpr double kSharpDegrees = 50;

Point Moved(const Point& p, const Point& direction, double distance) {
  Point moved = p;
  const double length = Norm(direction);
  for (size_t a = 0; a < 3; ++a) moved[a] += distance / length * direction[a];
  return moved;
}

/// Finds the place on `given` nearest to `p`. Searches from points further along `normal` if the
/// given surface does not face the same way there.
NearestTriangle::Place FindFacing(const SurfaceMesh& given, const NearestTriangle& index,
                                  const Point& p, const Point& normal, double edge_m) {
  const NearestTriangle::Place nearest = index.Find(p);
  for (const double step : {0.0, 0.1, 0.25}) {
    const NearestTriangle::Place place = index.Find(Moved(p, normal, step * edge_m));
    const auto corner = CornersOf(given, static_cast<size_t>(place.triangle));
    if (Dot(AreaNormal(corner), normal) > 0) return place;
  }
  return nearest;
}

SurfacePlace Weigh(const SurfaceMesh& given, const NearestTriangle::Place& place) {
  const auto t = static_cast<size_t>(place.triangle);
  const auto corner = CornersOf(given, t);
  const Point normal = AreaNormal(corner);
  SurfacePlace result{.vertices = given.triangles[t], .weights = {}};
  for (size_t c = 0; c < 3; ++c) {
    const Point part = AreaNormal({place.point, corner[(c + 1) % 3], corner[(c + 2) % 3]});
    result.weights[c] = std::clamp(Dot(part, normal) / Dot(normal, normal), 0.0, 1.0);
  }
  const double sum = result.weights[0] + result.weights[1] + result.weights[2];
  for (double& weight : result.weights) weight /= sum;
  return result;
}

/// Returns the surface without the triangles that have no area to integrate over, and without the
/// vertices that then belong to no triangle.
SurfaceMesh WithoutFlat(SurfaceMesh mesh, double edge_m) {
  constexpr double kFlat = 1e-9;
  std::erase_if(mesh.triangles, [&](const std::array<int32_t, 3>& triangle) {
    const Point &a = mesh.vertices[static_cast<size_t>(triangle[0])],
                &b = mesh.vertices[static_cast<size_t>(triangle[1])],
                &c = mesh.vertices[static_cast<size_t>(triangle[2])];
    return Norm(AreaNormal({a, b, c})) < kFlat * edge_m * edge_m;
  });
  return PartOf(mesh.vertices, std::move(mesh.triangles));
}

/// Returns how far the given surface lies outside the middle of the edge between two corners of a
/// triangle. Returns zero if curvature is not the cause, as at a rim that the edge cuts off.
double GapAt(const SurfaceMesh& given, const NearestTriangle& index, const Point& a, const Point& b,
             const Point& normal) {
  // Largest gap that curvature causes, as a fraction of the edge. A circle drawn with five corners
  // has about this gap.
  constexpr double kMostGap = 0.2;
  const double edge_m = Distance(a, b);
  Point middle{};
  for (size_t i = 0; i < 3; ++i) middle[i] = (a[i] + b[i]) / 2;
  const Point place = FindFacing(given, index, middle, normal, edge_m).point;
  const double gap_m = Dot(Difference(place, middle), normal) / Norm(normal);
  return std::abs(gap_m) < kMostGap * edge_m ? gap_m : 0;
}

/// Moves the vertices, which lie on the given surface, along their normals until the flat triangles
/// enclose the same volume as the given surface. Otherwise the chords would make a tube narrower,
/// and its air would resonate at other frequencies.
void KeepVolume(const SurfaceMesh& given, const NearestTriangle& index, SurfaceMesh& mesh) {
  std::vector<Point> normals(mesh.vertices.size());
  std::vector<double> areas(mesh.vertices.size());
  std::vector<double> volumes(mesh.vertices.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto corner = CornersOf(mesh, t);
    const Point normal = AreaNormal(corner);
    double gap_m = 0;  // the mean height of a parabola that is zero at the corners
    for (size_t c = 0; c < 3; ++c) {
      gap_m += GapAt(given, index, corner[c], corner[(c + 1) % 3], normal) / 3;
    }
    for (const int32_t v : mesh.triangles[t]) {
      const auto i = static_cast<size_t>(v);
      for (size_t a = 0; a < 3; ++a) normals[i][a] += normal[a];
      areas[i] += Norm(normal);
      volumes[i] += Norm(normal) * gap_m;
    }
  }
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    // If the normals differ, a step along their mean sweeps less volume than the sum of the areas
    // suggests.
    const double swept = Norm(normals[i]);
    if (swept > 0.5 * areas[i]) {
      mesh.vertices[i] = Moved(mesh.vertices[i], normals[i], volumes[i] / swept);
    }
  }
}

absl::StatusOr<SurfaceMesh> Remesh(const SurfaceMesh& given, double edge_m) {
  absl::StatusOr<SurfaceMesh> remeshed = RemeshSurface(given, edge_m, kSharpDegrees);
  if (remeshed.ok()) return remeshed;
  return Refusal(absl::StatusCode::kInternal, "RADIATION_REMESHING_FAILED",
                 absl::StrCat("the surface could not be meshed with edges of ", edge_m,
                              " m for its radiation: the mesher was ", remeshed.status().message(),
                              ". The modal model itself is sound; use it without a transfer, or "
                              "decompose the body with another number of nodes"));
}

}  // namespace

std::vector<SurfacePlace> PlacesOn(const SurfaceMesh& given, const NearestTriangle& index,
                                   const AcousticSurface& surface) {
  std::vector<SurfacePlace> places;
  for (size_t v = 0; v < surface.vertex_count(); ++v) {
    places.push_back(Weigh(given, FindFacing(given, index, surface.mesh.vertices[v],
                                             surface.area_vectors[v], surface.mean_edge_m)));
  }
  return places;
}

absl::StatusOr<RemeshedSurface> MakeRemeshedSurface(const RadiatingSurface& given,
                                                    const NearestTriangle& index, double edge_m,
                                                    Workers& workers) {
  ASSIGN_OR_RETURN(const SurfaceMesh remeshed, Remesh(given.mesh, edge_m));
  AcousticSurface near_it = MakeAcousticSurface(WithoutFlat(remeshed, edge_m));
  std::vector<SurfacePlace> places = PlacesOn(given.mesh, index, near_it);
  SurfaceMesh on_it = std::move(near_it.mesh);
  for (size_t v = 0; v < places.size(); ++v) {
    Point& p = on_it.vertices[v];
    p = {};
    for (size_t c = 0; c < 3; ++c) {
      const Point& corner = given.mesh.vertices[static_cast<size_t>(places[v].vertices[c])];
      for (size_t a = 0; a < 3; ++a) p[a] += places[v].weights[c] * corner[a];
    }
  }
  on_it = WithoutFlat(std::move(on_it), edge_m);
  KeepVolume(given.mesh, index, on_it);
  RemeshedSurface level{
      .surface = MakeAcousticSurface(std::move(on_it)), .near = {}, .places = std::move(places)};
  level.near = MakeNearCorrection(level.surface, workers);
  return level;
}

Displacement DisplacementOf(const SurfaceModes& modes, size_t mode, const RadiatingSurface& given,
                            const RemeshedSurface& level) {
  const size_t count = modes.mode_count();
  Displacement displacement;
  displacement.reserve(level.places.size());
  for (const SurfacePlace& place : level.places) {
    std::array<float, 3>& u = displacement.emplace_back();
    for (size_t c = 0; c < 3; ++c) {
      const auto vertex = static_cast<size_t>(place.vertices[c]);
      const float* shape =
          &modes.shapes[3 * count * static_cast<size_t>(given.body_vertex[vertex]) + mode];
      for (size_t a = 0; a < 3; ++a) {
        u[a] += static_cast<float>(place.weights[c]) * shape[a * count];
      }
    }
  }
  return displacement;
}

}  // namespace carillon::precompute
