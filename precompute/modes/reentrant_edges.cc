// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/reentrant_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// The distance within which the boundary must turn to act like an edge, in lengths of an element's
/// edge.
constexpr double kReach = 2;
/// The largest angle of the boundary's edges at a node on a flat face, in units of 90 degrees.
constexpr double kFlat = 0.03;
/// The aspect of elements up to which a flat wall needs no weight, the power of the aspect with
/// which the weight rises above it, and the weight of the flattest elements that were compared.
constexpr double kThinAspect = 3, kThinPower = 0.85, kThinMost = 4;
/// The angle from which an edge counts by itself only and not as part of a fillet, in units of 90
/// degrees.
constexpr double kSharp = 0.5;

Point At(const TetMesh& mesh, int32_t node) { return mesh.nodes[static_cast<size_t>(node)]; }

/// The normal of a boundary face, which points out of the body, of any length.
Point NormalOf(const TetMesh& mesh, const BoundaryFace& face) {
  const Point first = At(mesh, face.nodes[0]);
  return Cross(Difference(At(mesh, face.nodes[1]), first),
               Difference(At(mesh, face.nodes[2]), first));
}

/// The angle that two faces enclose within the body minus 180 degrees, in units of 90 degrees.
/// `opposite` is the corner of `second` that `first` does not have.
double Reentrance(const TetMesh& mesh, const BoundaryFace& first, const BoundaryFace& second,
                  int32_t opposite) {
  const Point normal = NormalOf(mesh, first);
  const Point other = NormalOf(mesh, second);
  const double angle = std::atan2(Norm(Cross(normal, other)), Dot(normal, other));
  const double rise = Dot(Difference(At(mesh, opposite), At(mesh, first.nodes[0])), normal);
  return (rise > 0 ? angle : -angle) / (std::numbers::pi / 2);
}

/// An edge of the boundary, with the angle by which its faces enclose more than 180 degrees of the
/// body, in units of 90 degrees. The angle of a convex edge is negative.
struct BentEdge {
  int32_t first = 0, second = 0;
  double angle = 0;
};

std::vector<BentEdge> BentEdges(const TetMesh& mesh) {
  std::vector<BentEdge> edges;
  absl::flat_hash_map<std::pair<int32_t, int32_t>, const BoundaryFace*> first_face;
  for (const BoundaryFace& face : mesh.boundary) {
    for (size_t i = 0; i < 3; ++i) {
      const int32_t a = face.nodes[i];
      const int32_t b = face.nodes[(i + 1) % 3];
      const auto [found, is_first] = first_face.try_emplace(std::minmax(a, b), &face);
      if (is_first) continue;
      edges.push_back({a, b, Reentrance(mesh, *found->second, face, face.nodes[(i + 2) % 3])});
    }
  }
  return edges;
}

/// Returns the mean length of the elements' edges at each node, and zero for mid-side nodes.
std::vector<double> MeanEdgeLengths(const TetMesh& mesh) {
  std::vector<double> sums(mesh.nodes.size()), counts(mesh.nodes.size());
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* corners = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    for (size_t i = 0; i < 4; ++i) {
      for (size_t j = 0; j < i; ++j) {
        const double length = Norm(Difference(At(mesh, corners[i]), At(mesh, corners[j])));
        for (const int32_t node : {corners[i], corners[j]}) {
          sums[static_cast<size_t>(node)] += length;
          counts[static_cast<size_t>(node)] += 1;
        }
      }
    }
  }
  for (size_t n = 0; n < sums.size(); ++n) sums[n] /= std::max(counts[n], 1.0);
  return sums;
}

/// Returns the longest edge of an element, divided by its least height; 1.2 if it is regular.
double Aspect(const TetMesh& mesh, const int32_t* corners) {
  double longest = 0, largest_area = 0;
  for (const auto& [a, b] : kTetEdges) {
    longest = std::max(longest, Norm(Difference(At(mesh, corners[a]), At(mesh, corners[b]))));
  }
  for (const auto& [a, b, c] : kTetFaces) {
    const Point first = At(mesh, corners[a]);
    const Point normal =
        Cross(Difference(At(mesh, corners[b]), first), Difference(At(mesh, corners[c]), first));
    largest_area = std::max(largest_area, Norm(normal) / 2);
  }
  const double volume = TetVolume(At(mesh, corners[0]), At(mesh, corners[1]), At(mesh, corners[2]),
                                  At(mesh, corners[3]));
  return longest * largest_area / (3 * volume);
}

/// Returns the least aspect of the elements at each node, which is large in a thin wall only: where
/// several elements lie between two faces, some are compact. Mid-side nodes have infinity.
std::vector<double> LeastAspects(const TetMesh& mesh) {
  std::vector<double> least(mesh.nodes.size(), HUGE_VAL);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* corners = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const double aspect = Aspect(mesh, corners);
    for (size_t i = 0; i < 4; ++i) {
      double& at_node = least[static_cast<size_t>(corners[i])];
      at_node = std::min(at_node, aspect);
    }
  }
  return least;
}

/// Sums the angles of the boundary's edges near a node.
class Turning {
 public:
  Turning(const TetMesh& mesh, const std::vector<BentEdge>& edges)
      : mesh_(mesh), edges_(edges), at_node_(mesh.nodes.size()), seen_from_(mesh.nodes.size(), -1) {
    for (size_t i = 0; i < edges.size(); ++i) {
      at_node_[static_cast<size_t>(edges[i].first)].push_back(i);
      at_node_[static_cast<size_t>(edges[i].second)].push_back(i);
    }
  }

  /// Returns the angle by which a strip of the boundary, of twice the radius in length and width,
  /// turns towards its outside at edges that are not sharp, in units of 90 degrees. It is the mean
  /// over the strip's width.
  double Around(int32_t node, double radius) {
    double sum = 0;
    std::vector<int32_t> open = {node};
    seen_from_[static_cast<size_t>(node)] = node;
    while (!open.empty()) {
      const int32_t here = open.back();
      open.pop_back();
      for (const size_t i : at_node_[static_cast<size_t>(here)]) {
        const BentEdge& edge = edges_[i];
        const int32_t there = edge.first == here ? edge.second : edge.first;
        // Each end of an edge within the radius adds half of the edge.
        const double length = std::min(Distance(here, there) / 2, radius);
        if (std::abs(edge.angle) < kSharp) sum += edge.angle * length;
        int32_t& seen_from = seen_from_[static_cast<size_t>(there)];
        if (seen_from == node || Distance(node, there) > radius) continue;
        seen_from = node;
        open.push_back(there);
      }
    }
    return sum / (2 * radius);
  }

 private:
  double Distance(int32_t a, int32_t b) const {
    return Norm(Difference(At(mesh_, a), At(mesh_, b)));
  }

  const TetMesh& mesh_;
  const std::vector<BentEdge>& edges_;
  std::vector<std::vector<size_t>> at_node_;  ///< indices of the edges at each node
  std::vector<int32_t> seen_from_;            ///< the last node from which each node was reached
};

}  // namespace

std::vector<double> PlaceWeights(const TetMesh& mesh) {
  const std::vector<BentEdge> edges = BentEdges(mesh);
  std::vector<double> sharpest(mesh.nodes.size()), most_bent(mesh.nodes.size());
  for (const BentEdge& edge : edges) {
    for (const int32_t node : {edge.first, edge.second}) {
      double& angle = sharpest[static_cast<size_t>(node)];
      angle = std::max(angle, edge.angle);
      double& bent = most_bent[static_cast<size_t>(node)];
      bent = std::max(bent, std::abs(edge.angle));
    }
  }
  const std::vector<double> aspects = LeastAspects(mesh);
  const std::vector<double> lengths = MeanEdgeLengths(mesh);
  Turning turning(mesh, edges);
  std::vector<double> weights(mesh.nodes.size(), 1);
  for (size_t n = 0; n < weights.size(); ++n) {
    if (lengths[n] == 0) continue;  // a mid-side node
    const double around = turning.Around(static_cast<int32_t>(n), kReach * lengths[n]);
    weights[n] += std::min(std::max(std::sqrt(sharpest[n]), around), 1.0);
    if (mesh.nodes_per_element != 10 || most_bent[n] > kFlat) continue;
    const double thin = std::pow(aspects[n] / kThinAspect, kThinPower);
    weights[n] = std::max(weights[n], std::min(thin, kThinMost));
  }
  return weights;
}

}  // namespace carillon::precompute
