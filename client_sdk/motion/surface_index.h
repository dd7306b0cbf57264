// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// The point of a surface that is nearest to a point outside or inside.
struct NearestPoint {
  Vector point_m = Vector::Zero();
  Vector normal = Vector::Zero();  ///< outward, of the face, edge or vertex on which the point lies
  double gap_m = 0;                ///< below zero inside
};

/// An edge whose faces meet at a convex angle of more than 20 degrees.
struct SharpEdge {
  Vector from_m = Vector::Zero(), to_m = Vector::Zero();
  Vector normal = Vector::Zero();  ///< the mean of both faces'
  double spread_cosine = 1;        ///< between that mean and each face's normal
};

/// The surface of a body, prepared for the search of contacts. It is not thread-safe to move, but
/// any number of threads may search.
class SurfaceIndex {
 public:
  explicit SurfaceIndex(const BodySurface& surface);
  ~SurfaceIndex();
  SurfaceIndex(const SurfaceIndex&) = delete;
  SurfaceIndex& operator=(const SurfaceIndex&) = delete;

  /// Returns the nearest point of the surface within `radius_m`, or nullopt.
  std::optional<NearestPoint> Nearest(const Vector& point, double radius_m) const;

  /// The vertices that stand out from all their neighbours: only they, and sharp edges, touch.
  const std::vector<Vector>& corners() const { return corners_; }
  /// True if a sharp edge ends at a corner, false if the corner is one of a round surface.
  bool sharp(size_t corner) const { return sharp_[corner]; }
  const std::vector<SharpEdge>& edges() const { return edges_; }
  const Eigen::AlignedBox3d& box() const { return box_; }
  /// True if each edge has two triangles that run along it in opposite directions.
  bool closed() const { return closed_; }

 private:
  struct Tree;
  void FindCorners(const BodySurface& surface);
  void FindEdges(const BodySurface& surface);

  std::unique_ptr<Tree> tree_;
  std::vector<Vector> corners_;
  std::vector<bool> sharp_;
  std::vector<SharpEdge> edges_;
  Eigen::AlignedBox3d box_;
  bool closed_ = true;
};

}  // namespace carillon::motion
