// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/make_wall.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Numbers of voxels along the diagonal and across a wall. The distance is interpolated linearly
/// between voxels, which is exact for an isosurface far from edges.
constexpr double kVoxelsAcross = 120;
constexpr double kVoxelsInWall = 1.5;
constexpr double kMostVoxelsAcross = 1000;
/// Number of attempts with half the voxel size, after an isosurface that fails the checks.
constexpr int kMostHalvings = 2;
/// Degree to which OpenVDB may merge the isosurface's polygons, 0 to 1. With this value a ball
/// keeps its volume within half a percent.
constexpr float kFlatness = 0.01F;

absl::Status Impossible(const std::string& what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_WALL_IMPOSSIBLE", what);
}

openvdb::FloatGrid::Ptr DistanceGrid(const SurfaceMesh& surface, double voxel, double band,
                                     bool has_inside) {
  openvdb::initialize();
  std::vector<openvdb::Vec3s> points;
  for (const Point& p : surface.vertices) {
    points.emplace_back(static_cast<float>(p[0] / voxel), static_cast<float>(p[1] / voxel),
                        static_cast<float>(p[2] / voxel));
  }
  std::vector<openvdb::Vec3I> triangles;
  for (const auto& triangle : surface.triangles) {
    if (IsCollapsed(triangle)) continue;
    triangles.emplace_back(static_cast<unsigned>(triangle[0]), static_cast<unsigned>(triangle[1]),
                           static_cast<unsigned>(triangle[2]));
  }
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points,
                                                                                        triangles);
  // In index space, of voxels of one; two further voxels for the isosurface's stencil.
  const auto width = static_cast<float>(band / voxel + 3);
  const int flags = has_inside ? 0 : openvdb::tools::UNSIGNED_DISTANCE_FIELD;
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      mesh, *openvdb::math::Transform::createLinearTransform(1), width, width, flags);
}

/// The isosurface at distance `level_m`; its triangles are counter-clockwise seen from the side of
/// greater distance.
SurfaceMesh Isosurface(const openvdb::FloatGrid& distance, double voxel, double level_m) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(distance, points, triangles, quads, level_m / voxel, kFlatness);
  SurfaceMesh surface;
  for (const openvdb::Vec3s& p : points) {
    surface.vertices.push_back({voxel * p[0], voxel * p[1], voxel * p[2]});
  }
  // OpenVDB turns its polygons clockwise.
  const auto add = [&](unsigned a, unsigned b, unsigned c) {
    surface.triangles.push_back(
        {static_cast<int32_t>(a), static_cast<int32_t>(c), static_cast<int32_t>(b)});
  };
  for (const openvdb::Vec3I& t : triangles) add(t[0], t[1], t[2]);
  for (const openvdb::Vec4I& q : quads) {
    add(q[0], q[1], q[2]);
    add(q[0], q[2], q[3]);
  }
  return surface;
}

/// Turns the surface outward where `outward`, else inward.
void Turn(SurfaceMesh& surface, bool outward) {
  double volume = 0;
  for (const Shell& shell : FindShells(surface)) volume += shell.volume_m3;
  if ((volume > 0) == outward) return;
  for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
}

struct Grid {
  double voxel;
  double diagonal;
};

absl::StatusOr<Grid> ChooseGrid(const SurfaceMesh& surface, double wall_m) {
  const double diagonal = Diagonal(surface.vertices);
  const double voxel = std::min(diagonal / kVoxelsAcross, wall_m / kVoxelsInWall);
  if (!(wall_m < diagonal)) {
    return Impossible(
        absl::StrFormat("a wall of %g m is as thick as the whole body of %g m: give a "
                        "thinner wall, or the right unit of the file",
                        wall_m, diagonal));
  }
  if (voxel * kMostVoxelsAcross >= diagonal) return Grid{voxel, diagonal};
  return Impossible(
      absl::StrFormat("a wall of %g m is too thin beside a body of %g m: it must be at "
                      "least %g m; give a thicker wall, or draw both sides of it",
                      wall_m, diagonal, diagonal / kMostVoxelsAcross * kVoxelsInWall));
}

RepairedSurface Made(SurfaceMesh surface, const std::string& remark) {
  return {std::move(surface), {remark}};
}

}  // namespace

absl::StatusOr<RepairedSurface> HollowOut(const SurfaceMesh& surface, double wall_m) {
  ASSIGN_OR_RETURN(Grid grid, ChooseGrid(surface, wall_m));
  absl::Status unsound;
  for (int halvings = 0; halvings <= kMostHalvings; ++halvings, grid.voxel /= 2) {
    const auto distance = DistanceGrid(surface, grid.voxel, wall_m, /*has_inside=*/true);
    SurfaceMesh inner = Isosurface(*distance, grid.voxel, -wall_m);
    if (inner.triangles.empty()) {
      return Impossible(absl::StrFormat(
          "the body is nowhere thicker than twice a wall of %g m: give a thinner wall, or none",
          wall_m));
    }
    Turn(inner, /*outward=*/false);
    SurfaceMesh hollow = surface;
    const auto first = static_cast<int32_t>(hollow.vertices.size());
    hollow.vertices.insert(hollow.vertices.end(), inner.vertices.begin(), inner.vertices.end());
    for (auto triangle : inner.triangles) {
      for (int32_t& corner : triangle) corner += first;
      hollow.triangles.push_back(triangle);
    }
    unsound = CheckSurface(hollow).status();
    if (unsound.ok()) {
      return Made(std::move(hollow), absl::StrFormat("hollowed out to a wall of %g m", wall_m));
    }
  }
  return Impossible(absl::StrFormat("a wall of %g m could not be made: %s", wall_m,
                                    std::string(unsound.message())));
}

bool HasTwoSides(const SurfaceMesh& surface, double distance_m) {
  constexpr int kSampleCount = 400;
  const double least_m = 1e-6 * Diagonal(surface.vertices);
  std::vector<double> area;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    area.push_back(Norm(AreaNormal(CornersOf(surface, t))));
  }
  if (!(std::accumulate(area.begin(), area.end(), 0.0) > 0)) return false;
  const NearestTriangle index(surface);
  std::mt19937 random(1);
  std::discrete_distribution<size_t> pick(area.begin(), area.end());
  int count = 0;
  for (int i = 0; i < kSampleCount; ++i) {
    const auto corners = CornersOf(surface, pick(random));
    const Point normal = AreaNormal(corners), middle = MiddleOf(corners);
    const Point back = {-normal[0], -normal[1], -normal[2]};
    count += index.DistanceAlong(middle, normal, least_m) <= distance_m ||
             index.DistanceAlong(middle, back, least_m) <= distance_m;
  }
  return count > kSampleCount / 2;
}

absl::StatusOr<RepairedSurface> Thicken(const SurfaceMesh& sheet, double wall_m) {
  ASSIGN_OR_RETURN(Grid grid, ChooseGrid(sheet, wall_m));
  absl::Status unsound;
  for (int halvings = 0; halvings <= kMostHalvings; ++halvings, grid.voxel /= 2) {
    const auto distance = DistanceGrid(sheet, grid.voxel, wall_m, /*has_inside=*/false);
    SurfaceMesh shell = Isosurface(*distance, grid.voxel, wall_m / 2);
    Turn(shell, /*outward=*/true);
    unsound = CheckSurface(shell).status();
    if (unsound.ok()) {
      return Made(std::move(shell),
                  absl::StrFormat("the open sheet was given a thickness of %g m", wall_m));
    }
  }
  return Impossible(absl::StrFormat("a wall of %g m could not be made: %s", wall_m,
                                    std::string(unsound.message())));
}

}  // namespace carillon::precompute
