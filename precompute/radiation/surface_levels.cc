// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/surface_levels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "precompute/mesh/point_math.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Number of edges of the coarsest level in the radius of a sphere that has the same area as the
/// body. The sphere around the body would be a worse measure for thin walls and long bodies.
constexpr double kEdgesPerRadius = 9;
/// Largest number of vertices of a level. A sweep over such a level takes seconds.
constexpr double kMostVertices = 40000;

double AreaM2(const SurfaceMesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    area += Norm(AreaNormal(CornersOf(mesh, t))) / 2;
  }
  return area;
}

}  // namespace

SurfaceLevels::SurfaceLevels(const RadiatingSurface& body, Workers& workers)
    : body_(body),
      workers_(workers),
      area_m2_(AreaM2(body.mesh)),
      coarsest_edge_m_(std::sqrt(area_m2_ / (4 * std::numbers::pi)) / kEdgesPerRadius),
      index_(body.mesh) {}

bool SurfaceLevels::Exists(int level) const {
  return level <= kFinest && VertexCountOf(level) <= kMostVertices;
}

double SurfaceLevels::EdgeOf(int level) const { return coarsest_edge_m_ * std::exp2(-0.5 * level); }

int SurfaceLevels::LevelOf(double edge_m) const {
  const double finer = 2 * std::log2(EdgeOf(0) / edge_m);
  return std::clamp(static_cast<int>(std::round(std::clamp(finer, 0.0, double{kFinest}))), 0,
                    kFinest - 1);
}

double SurfaceLevels::VertexCountOf(int level) const {
  if (const auto made = levels_.find(level); made != levels_.end()) {
    return static_cast<double>(made->second.level.surface.vertex_count());
  }
  // A closed surface has half as many vertices as triangles, and the triangles are nearly
  // equilateral.
  return area_m2_ / (std::sqrt(3.0) / 2 * EdgeOf(level) * EdgeOf(level));
}

absl::StatusOr<const SurfaceLevels::Made*> SurfaceLevels::At(int level) {
  if (const auto made = levels_.find(level); made != levels_.end()) return &made->second;
  ASSIGN_OR_RETURN(RemeshedSurface surface,
                   MakeRemeshedSurface(body_, index_, EdgeOf(level), workers_));
  Made& made = levels_.try_emplace(level, std::move(surface)).first->second;
  if (const auto before = levels_.find(level - 1); before != levels_.end()) {
    made.places_before =
        PlacesOn(before->second.level.surface.mesh, before->second.index, made.level.surface);
  }
  return &made;
}

}  // namespace carillon::precompute
