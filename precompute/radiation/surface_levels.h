// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/radiation/surface_level.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The surfaces that the modes of one body are solved on, each sqrt(2) times as fine as the one
/// before it. They are made when they are first asked for.
class SurfaceLevels {
 public:
  /// A level, and where its vertices lie on the level before it (empty where that was not made).
  struct Made {
    explicit Made(SurfaceLevel made) : level(std::move(made)), index(level.surface.mesh) {}

    SurfaceLevel level;
    NearestTriangle index;
    std::vector<SurfacePlace> places_before;
  };

  /// Keeps the references.
  SurfaceLevels(const RadiatingSurface& body, Workers& workers);

  static constexpr int kFinest = 8;

  /// Whether the level exists, in principle: not too fine, and not too large.
  bool Exists(int level) const;
  bool IsMade(int level) const { return levels_.contains(level); }
  /// Edges that are asked for, metres.
  double EdgeOf(int level) const;
  /// The coarsest level whose edges are about `edge_m`, or nearest to it.
  int LevelOf(double edge_m) const;
  /// As made, or predicted.
  double VertexCountOf(int level) const;

  /// Errors: those of MakeSurfaceLevel.
  absl::StatusOr<const Made*> At(int level);

 private:
  const RadiatingSurface& body_;
  Workers& workers_;
  double area_m2_;
  double coarsest_edge_m_;
  NearestTriangle index_;
  std::map<int, Made> levels_;
};

}  // namespace carillon::precompute
