// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/surface_shells.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// Disjoint sets of triangles, with path halving.
class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  size_t Find(size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  void Join(size_t i, size_t j) { parent_[Find(i)] = Find(j); }

 private:
  std::vector<size_t> parent_;
};

/// Measured from `origin`, near the shell, so that little is lost to cancellation.
double SignedVolume(const SurfaceMesh& surface, const std::vector<int32_t>& triangles) {
  const Point origin = CornersOf(surface, static_cast<size_t>(triangles.front()))[0];
  double volume = 0;
  for (const int32_t t : triangles) {
    const auto [a, b, c] = CornersOf(surface, static_cast<size_t>(t));
    volume -= TetVolume(a, b, c, origin);
  }
  return volume;
}

DisjointSets JoinAlongEdges(const SurfaceMesh& surface) {
  DisjointSets sets(surface.triangles.size());
  absl::flat_hash_map<std::pair<int32_t, int32_t>, size_t> triangle_of_edge;
  triangle_of_edge.reserve(surface.triangles.size() * 3 / 2);
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& corner = surface.triangles[t];
    if (IsCollapsed(corner)) continue;
    for (size_t i = 0; i < 3; ++i) {
      const auto edge = std::minmax(corner[i], corner[(i + 1) % 3]);
      const auto [found, is_new] = triangle_of_edge.try_emplace(edge, t);
      if (!is_new) sets.Join(t, found->second);
    }
  }
  return sets;
}

}  // namespace

bool IsCollapsed(const std::array<int32_t, 3>& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

std::vector<Shell> FindShells(const SurfaceMesh& surface) {
  DisjointSets sets = JoinAlongEdges(surface);
  std::vector<Shell> shells;
  absl::flat_hash_map<size_t, size_t> shell_of_set;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    if (IsCollapsed(surface.triangles[t])) continue;
    const auto [found, is_new] = shell_of_set.try_emplace(sets.Find(t), shells.size());
    if (is_new) shells.emplace_back();
    shells[found->second].triangles.push_back(static_cast<int32_t>(t));
  }
  for (Shell& shell : shells) shell.volume_m3 = SignedVolume(surface, shell.triangles);
  std::ranges::stable_sort(shells, std::ranges::greater{},
                           [](const Shell& shell) { return std::abs(shell.volume_m3); });
  return shells;
}

double WindingNumber(const SurfaceMesh& surface, const Shell& shell, const Point& point) {
  double solid_angle = 0;
  for (const int32_t t : shell.triangles) {
    auto [a, b, c] = CornersOf(surface, static_cast<size_t>(t));
    a = Difference(a, point);
    b = Difference(b, point);
    c = Difference(c, point);
    const double la = Norm(a), lb = Norm(b), lc = Norm(c);
    const double cosine_part = la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la + Dot(c, a) * lb;
    solid_angle += 2 * std::atan2(Dot(a, Cross(b, c)), cosine_part);
  }
  return solid_angle / (4 * std::numbers::pi);
}

Point PointInside(const SurfaceMesh& surface, const Shell& shell) {
  const auto area = [&](int32_t t) {
    return Norm(AreaNormal(CornersOf(surface, static_cast<size_t>(t))));
  };
  const auto largest =
      CornersOf(surface, static_cast<size_t>(*std::ranges::max_element(shell.triangles, {}, area)));
  const Point normal = AreaNormal(largest);
  const double length = Norm(normal);
  // A step into the shell from the middle of its largest triangle, halved until it does not leave
  // through the other side.
  for (double step = std::copysign(std::sqrt(length) / 8, shell.volume_m3);; step /= 2) {
    Point point;
    for (size_t x = 0; x < 3; ++x) {
      point[x] = (largest[0][x] + largest[1][x] + largest[2][x]) / 3 - step * normal[x] / length;
    }
    const bool inside = std::abs(WindingNumber(surface, shell, point)) > 0.5;
    if (inside || std::abs(step) < 1e-9 * std::sqrt(length)) return point;
  }
}

}  // namespace carillon::precompute
