// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/radiation/remeshed_surface.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The surfaces on which the modes of one body are solved. The edges of each level are 1/sqrt(2)
/// times as long as those of the level before. A level is made when At() first returns it.
class SurfaceLevels {
 public:
  /// A level, and the places of its vertices on the level before. There are no places if the level
  /// before was not made.
  struct Made {
    explicit Made(RemeshedSurface made) : level(std::move(made)), index(level.surface.mesh) {}

    RemeshedSurface level;
    NearestTriangle index;
    std::vector<SurfacePlace> places_before;
  };

  /// Keeps references to the arguments, which must outlive the object.
  SurfaceLevels(const RadiatingSurface& body, Workers& workers);

  static constexpr int kFinest = 8;

  /// Returns whether the level may be made. It may not be made if its edges would be too fine or
  /// its vertices too many.
  bool Exists(int level) const;
  bool IsMade(int level) const { return levels_.contains(level); }
  /// Returns the requested length of the level's edges, metres.
  double EdgeOf(int level) const;
  /// Returns the level whose edges are nearest to `edge_m`, but at most kFinest - 1, so that a
  /// finer level follows.
  int LevelOf(double edge_m) const;
  /// Returns the number of vertices of the level, or a prediction if the level is not made.
  double VertexCountOf(int level) const;

  /// Returns the level, and makes it if necessary. Errors: those of MakeRemeshedSurface.
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
