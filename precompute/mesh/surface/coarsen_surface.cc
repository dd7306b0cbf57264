// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/coarsen_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/mesh/surface/refine_surface.h"
#include "precompute/mesh/surface/remesh_surface.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

/// Edges along the body's longest side, and for each mean thickness of it.
constexpr double kEdgesAlongBody = 40, kEdgesPerThickness = 4;
/// The creases of a scanned surface are less sharp than the edges of a box.
constexpr double kSharpDegrees = 75;
constexpr size_t kLeastTriangles = 2'000;
/// A result with a larger part of the triangles is not worth the change.
constexpr double kWorthwhile = 2.0 / 3;
/// A surface of few triangles is coarsened, too, if it would be divided into this many times the
/// triangles of a regular mesh and of its own, because they are as narrow as the sides of a
/// cylinder of hundreds of facets.
constexpr double kNarrowToRegular = 6, kNarrowToGiven = 3;
/// Growth of the number of triangles from one try to the next.
constexpr double kGrowth = 2;
/// Largest distances between both surfaces, in parts of the thickness at each place.
constexpr double kMostRms = 0.01, kMostDistance = 0.5;
/// Thinner places count as this part of the mean thickness.
constexpr double kLeastThickness = 0.05;

struct Extent {
  double area_m2 = 0;
  double thickness_m = 0;  ///< mean: twice the volume over the area
  double length_m = 0;     ///< longest side of the box around it
};

Extent Measure(const SurfaceMesh& surface) {
  Extent extent;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    extent.area_m2 += Norm(AreaNormal(CornersOf(surface, t))) / 2;
  }
  double volume_m3 = 0;
  for (const Shell& shell : FindShells(surface)) volume_m3 += shell.volume_m3;
  extent.thickness_m = 2 * std::abs(volume_m3) / extent.area_m2;
  for (size_t x = 0; x < 3; ++x) {
    const auto [low, high] =
        std::ranges::minmax(surface.vertices, {}, [x](const Point& p) { return p[x]; });
    extent.length_m = std::max(extent.length_m, high[x] - low[x]);
  }
  return extent;
}

/// Regular triangles with edges of this length.
double TriangleCount(const Extent& extent, double edge_m) {
  return 4 * extent.area_m2 / (std::sqrt(3.0) * edge_m * edge_m);
}

double EdgeForTriangles(const Extent& extent, double count) {
  return std::sqrt(4 * extent.area_m2 / (std::sqrt(3.0) * count));
}

double WantedTriangles(const Extent& extent, size_t most_triangles) {
  const double edge_m =
      std::min(extent.length_m / kEdgesAlongBody, extent.thickness_m * kEdgesPerThickness);
  double most = kMaxUncoarsenedTriangles;
  if (most_triangles > 0) most = std::min(most, static_cast<double>(most_triangles));
  return std::max(std::min(TriangleCount(extent, edge_m), most),
                  static_cast<double>(kLeastTriangles));
}

/// The number of triangles of the surface once none has longer edges than a mesh of `edge_m`.
double DividedTriangles(const SurfaceMesh& surface, double edge_m) {
  constexpr double kLongestToMeanEdge = 1.4;  // as Tetrahedralize divides it
  return static_cast<double>(
      RefineSurface(surface, kLongestToMeanEdge * edge_m).surface.triangles.size());
}

/// Moves the vertices so that the surface lies on both sides of the given one. The middle of a
/// triangle with its corners on a sphere lies below it by some depth, and its points by 3/4 of that
/// depth on average. Without this move a remeshed body would be smaller than the given one.
void Balance(const NearestTriangle& given, SurfaceMesh& coarse) {
  constexpr double kMeanToMiddle = 0.75;
  std::vector<Point> moves(coarse.vertices.size());
  std::vector<double> areas(coarse.vertices.size());
  for (size_t t = 0; t < coarse.triangles.size(); ++t) {
    const auto corners = CornersOf(coarse, t);
    const double area = Norm(AreaNormal(corners));
    const Point middle = MiddleOf(corners);
    const Point to_given = Difference(given.Find(middle).point, middle);
    for (const int32_t corner : coarse.triangles[t]) {
      const auto v = static_cast<size_t>(corner);
      areas[v] += area;
      for (size_t x = 0; x < 3; ++x) moves[v][x] += area * kMeanToMiddle * to_given[x];
    }
  }
  for (size_t v = 0; v < moves.size(); ++v) {
    if (areas[v] == 0) continue;
    for (size_t x = 0; x < 3; ++x) coarse.vertices[v][x] += moves[v][x] / areas[v];
  }
}

/// The distances between two surfaces, in parts of the body's thickness at each place.
struct Deviation {
  double rms = 0;
  double greatest = 0;
  double greatest_m = 0;
};

std::vector<Point> VertexNormals(const SurfaceMesh& surface) {
  std::vector<Point> normals(surface.vertices.size());
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const Point normal = AreaNormal(CornersOf(surface, t));
    for (const int32_t corner : surface.triangles[t]) {
      for (size_t x = 0; x < 3; ++x) normals[static_cast<size_t>(corner)][x] += normal[x];
    }
  }
  return normals;
}

/// Measures how far the vertices of the given surface lie from the other. Modes of thin parts, such
/// as ears, change most where these are changed, so that the thickness beneath each vertex counts.
Deviation Compare(const SurfaceMesh& given, const NearestTriangle& on_given,
                  const SurfaceMesh& coarse, const Extent& extent) {
  // Beneath sharp edges the thickness vanishes.
  const double least_m = kLeastThickness * extent.thickness_m;
  const NearestTriangle on_coarse(coarse);
  const std::vector<Point> normals = VertexNormals(given);
  Deviation deviation;
  double sum = 0;
  for (size_t v = 0; v < given.vertices.size(); ++v) {
    const Point& p = given.vertices[v];
    const double distance_m = on_coarse.Find(p).distance_m;
    const Point inwards = {-normals[v][0], -normals[v][1], -normals[v][2]};
    double thickness_m = extent.length_m;
    if (Norm(inwards) > 0) thickness_m = on_given.DistanceAlong(p, inwards, least_m);
    const double part = distance_m / std::min(thickness_m, extent.length_m);
    sum += part * part;
    deviation.greatest = std::max(deviation.greatest, part);
    deviation.greatest_m = std::max(deviation.greatest_m, distance_m);
  }
  deviation.rms = std::sqrt(sum / static_cast<double>(given.vertices.size()));
  deviation.greatest_m = std::max(deviation.greatest_m, GreatestDistance(coarse, on_given));
  return deviation;
}

}  // namespace

std::optional<CoarsenedSurface> CoarsenSurface(const SurfaceMesh& surface, size_t most_triangles,
                                               TriangleOrigin origin) {
  constexpr double kTrianglesPerPlain = 4;  // edges half as long
  const bool wrap = origin == TriangleOrigin::kWrap;
  const Extent extent = Measure(surface);
  const auto given_count = static_cast<double>(surface.triangles.size());
  double count = WantedTriangles(extent, most_triangles);
  double most = kWorthwhile * given_count;
  if (wrap) {
    count /= kTrianglesPerPlain;
  } else if (surface.triangles.size() <= kMaxUncoarsenedTriangles) {
    count /= kTrianglesPerPlain;
    const double divided_count = DividedTriangles(surface, EdgeForTriangles(extent, count));
    if (divided_count < kNarrowToRegular * count || divided_count < kNarrowToGiven * given_count) {
      return std::nullopt;
    }
    most = kWorthwhile * divided_count;
  }
  const NearestTriangle on_given(surface);
  for (; count < most; count *= kGrowth) {
    absl::StatusOr<SurfaceMesh> coarse =
        RemeshSurface(surface, EdgeForTriangles(extent, count), kSharpDegrees);
    if (!coarse.ok() || static_cast<double>(coarse->triangles.size()) > most) continue;
    Balance(on_given, *coarse);
    const Deviation deviation = Compare(surface, on_given, *coarse, extent);
    if (deviation.rms > kMostRms || deviation.greatest > kMostDistance ||
        !CheckSurface(*coarse).ok()) {
      continue;
    }
    std::string remark = absl::StrFormat(
        "the surface of %d triangles was made coarser: the new one of %d triangles lies at most "
        "%.3g m from it, and on average (root mean square) %.2g %% of the body's thickness; ask to "
        "keep the surface (--keep-surface) or for an accuracy (--accuracy) to have all its "
        "triangles",
        surface.triangles.size(), coarse->triangles.size(), deviation.greatest_m,
        100 * deviation.rms);
    return CoarsenedSurface{*std::move(coarse), std::move(remark), deviation.rms};
  }
  return std::nullopt;
}

}  // namespace carillon::precompute
