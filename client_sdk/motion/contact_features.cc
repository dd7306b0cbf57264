// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/contact_features.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carillon::motion {
namespace {

constexpr size_t kMostFeatures = 8, kMostInStep = 16;
constexpr uint64_t kCornerOfA = 0, kCornerOfB = uint64_t{1} << 62U, kEdges = uint64_t{2} << 62U;

Vector ToScene(const BodyPose& pose, const Vector& point) {
  return pose.position_m + pose.orientation * point;
}
Vector ToBody(const BodyPose& pose, const Vector& point) {
  return pose.orientation.conjugate() * (point - pose.position_m);
}

/// Adds the corners of one body that lie near the surface of the other.
void AddCorners(const SurfaceIndex& of, const SurfaceIndex& on, const PairPlacement& at,
                double reach_m, bool of_is_a, std::vector<ContactFeature>& features) {
  const BodyPose &of_pose = of_is_a ? at.a : at.b, &on_pose = of_is_a ? at.b : at.a;
  const Turn turn = on_pose.orientation.conjugate() * of_pose.orientation;
  const Vector shift = ToBody(on_pose, of_pose.position_m);
  Eigen::AlignedBox3d near = on.box();
  near.extend(on.box().min() - Vector::Constant(reach_m));
  near.extend(on.box().max() + Vector::Constant(reach_m));
  const Matrix matrix = turn.toRotationMatrix();
  for (size_t i = 0; i < of.corners().size(); ++i) {
    const Vector corner = matrix * of.corners()[i] + shift;
    if (!near.contains(corner)) continue;
    const auto nearest = on.Nearest(corner, reach_m);
    if (!nearest) continue;
    const Vector normal = on_pose.orientation * nearest->normal;
    if (of_is_a) {
      features.push_back({kCornerOfA | i, of.corners()[i], nearest->point_m, normal, nearest->gap_m,
                          !of.sharp(i)});
    } else {
      features.push_back({kCornerOfB | i, nearest->point_m, of.corners()[i], -normal,
                          nearest->gap_m, !of.sharp(i)});
    }
  }
}

struct PlacedEdge {
  uint64_t index = 0;
  Vector from, along, normal;
  double spread_cosine = 1;
};

/// Returns the sharp edges of a body that lie near the box of another, in the scene.
std::vector<PlacedEdge> EdgesNear(const SurfaceIndex& of, const SurfaceIndex& other,
                                  const BodyPose& pose, const BodyPose& other_pose,
                                  double reach_m) {
  std::vector<PlacedEdge> edges;
  const Eigen::AlignedBox3d near(other.box().min() - Vector::Constant(reach_m),
                                 other.box().max() + Vector::Constant(reach_m));
  for (size_t i = 0; i < of.edges().size(); ++i) {
    const SharpEdge& edge = of.edges()[i];
    const Vector from = ToScene(pose, edge.from_m), to = ToScene(pose, edge.to_m);
    Eigen::AlignedBox3d box(ToBody(other_pose, from));
    box.extend(ToBody(other_pose, to));
    if (!near.intersects(box)) continue;
    edges.push_back({i, from, to - from, pose.orientation * edge.normal, edge.spread_cosine});
  }
  return edges;
}

void AddEdgePair(const PlacedEdge& a, const PlacedEdge& b, const PairPlacement& at, double reach_m,
                 std::vector<ContactFeature>& features) {
  constexpr double kParallelSine = 0.1, kInside = 1e-3, kSlackCosine = 0.1;
  const Vector across = a.along.cross(b.along);
  const double sine = across.norm() / (a.along.norm() * b.along.norm());
  if (!(sine > kParallelSine)) return;
  Vector normal = across.normalized();
  if (normal.dot(b.normal - a.normal) < 0) normal = -normal;
  const Vector between = b.from - a.from;
  const double gap = -between.dot(normal);
  if (std::abs(gap) > reach_m) return;
  if (normal.dot(b.normal) < b.spread_cosine - kSlackCosine) return;
  if (-normal.dot(a.normal) < a.spread_cosine - kSlackCosine) return;
  const double square = across.squaredNorm();
  const double s = between.cross(b.along).dot(across) / square;
  const double t = between.cross(a.along).dot(across) / square;
  if (s < kInside || s > 1 - kInside || t < kInside || t > 1 - kInside) return;
  features.push_back({kEdges | (a.index << 31U) | b.index, ToBody(at.a, a.from + s * a.along),
                      ToBody(at.b, b.from + t * b.along), normal, gap});
}

/// Keeps those farthest apart, beginning with the deepest.
void KeepSpread(const BodyPose& pose, size_t most, std::vector<ContactFeature>& features) {
  if (features.size() <= most) return;
  std::ranges::swap(features.front(),
                    *std::ranges::min_element(features, {}, &ContactFeature::gap_m));
  std::vector<double> away(features.size(), std::numeric_limits<double>::max());
  for (size_t kept = 1; kept < most; ++kept) {
    const Vector last = ToScene(pose, features[kept - 1].point_a);
    size_t farthest = kept;
    for (size_t i = kept; i < features.size(); ++i) {
      away[i] = std::min(away[i], (ToScene(pose, features[i].point_a) - last).squaredNorm());
      if (away[i] > away[farthest]) farthest = i;
    }
    std::swap(features[kept], features[farthest]);
    std::swap(away[kept], away[farthest]);
  }
  features.resize(most);
}

}  // namespace

std::vector<ContactFeature> FindFeatures(const SurfaceIndex& a, const SurfaceIndex& b,
                                         const PairPlacement& at, double reach_m,
                                         std::optional<double> beyond_m) {
  std::vector<ContactFeature> features;
  AddCorners(a, b, at, reach_m, true, features);
  AddCorners(b, a, at, reach_m, false, features);
  const std::vector<PlacedEdge> edges_a = EdgesNear(a, b, at.a, at.b, reach_m);
  if (!edges_a.empty()) {
    for (const PlacedEdge& edge_b : EdgesNear(b, a, at.b, at.a, reach_m)) {
      for (const PlacedEdge& edge_a : edges_a) AddEdgePair(edge_a, edge_b, at, reach_m, features);
    }
  }
  if (features.empty()) return features;
  if (beyond_m) {
    const double least = std::ranges::min_element(features, {}, &ContactFeature::gap_m)->gap_m;
    std::erase_if(features, [&](const ContactFeature& f) {
      return f.gap_m > least + (f.round ? *beyond_m : reach_m);
    });
  }
  KeepSpread(at.a, beyond_m ? kMostFeatures : kMostInStep, features);
  return features;
}

}  // namespace carillon::motion
