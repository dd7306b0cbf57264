// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/refine_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <queue>
#include <tuple>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/container/inlined_vector.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

using Edge = std::pair<int32_t, int32_t>;

Edge EdgeOf(int32_t a, int32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// The triangles of an edge: two, or more at the rim of a wall inside the body.
using Sides = absl::InlinedVector<int32_t, 2>;

/// A closed surface whose edges can be split and flipped.
class Refiner {
 public:
  Refiner(const SurfaceMesh& surface, double max_edge_m, const SizeField& relative_size)
      : max_edge_m_(max_edge_m), relative_size_(relative_size) {
    refined_.surface.vertices = surface.vertices;
    for (size_t t = 0; t < surface.triangles.size(); ++t) {
      if (!IsCollapsed(surface.triangles[t])) Add(surface.triangles[t], static_cast<int32_t>(t));
    }
  }

  RefinedSurface Refine() && {
    SplitLongEdges();
    edges_inside_too_ = true;
    for (const auto& [edge, sides] : triangles_of_edge_) NoteIfLong(edge);
    SplitLongEdges();
    return std::move(refined_);
  }

 private:
  const Point& Vertex(int32_t v) const { return refined_.surface.vertices[static_cast<size_t>(v)]; }
  std::array<int32_t, 3>& Triangle(int32_t t) {
    return refined_.surface.triangles[static_cast<size_t>(t)];
  }
  int32_t& Given(int32_t t) { return refined_.given_triangle[static_cast<size_t>(t)]; }

  int32_t Apex(int32_t t, const Edge& edge) {
    return *std::ranges::find_if(Triangle(t),
                                 [&](int32_t v) { return v != edge.first && v != edge.second; });
  }

  bool IsInside(const Sides& sides) {
    return sides.size() == 2 && Given(sides[0]) == Given(sides[1]);
  }

  void Add(const std::array<int32_t, 3>& triangle, int32_t given_triangle) {
    const auto t = static_cast<int32_t>(refined_.surface.triangles.size());
    refined_.surface.triangles.push_back(triangle);
    refined_.given_triangle.push_back(given_triangle);
    for (size_t i = 0; i < 3; ++i) Attach(EdgeOf(triangle[i], triangle[(i + 1) % 3]), t);
  }

  /// Each call for an edge notes one side.
  void Attach(const Edge& edge, int32_t t) {
    Sides& sides = triangles_of_edge_[edge];
    sides.push_back(t);
    if (sides.size() > 1) NoteIfLong(edge);
  }

  void Reattach(const Edge& edge, int32_t from, int32_t to) {
    std::ranges::replace(triangles_of_edge_.at(edge), from, to);
  }

  void NoteIfLong(const Edge& edge) {
    if (!edges_inside_too_ && IsInside(triangles_of_edge_.at(edge))) return;
    const double length = RelativeLength(edge);
    if (length > max_edge_m_) long_edges_.emplace(length, edge.first, edge.second);
  }

  /// The length of the edge, divided by the relative size at its middle.
  double RelativeLength(const Edge& edge) const {
    const Point &a = Vertex(edge.first), &b = Vertex(edge.second);
    if (relative_size_.is_uniform()) return Distance(a, b);
    return Distance(a, b) /
           relative_size_.At({(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2});
  }

  void SplitLongEdges() {
    while (!long_edges_.empty()) {
      const auto [length, a, b] = long_edges_.top();
      long_edges_.pop();
      if (triangles_of_edge_.contains({a, b})) Split({a, b});  // else it was flipped away
    }
  }

  void Split(const Edge& edge) {
    const Sides sides = triangles_of_edge_.at(edge);
    std::vector<int32_t> apexes;
    apexes.reserve(sides.size());
    for (const int32_t t : sides) apexes.push_back(Apex(t, edge));
    triangles_of_edge_.erase(edge);
    const auto middle = static_cast<int32_t>(refined_.surface.vertices.size());
    refined_.surface.vertices.push_back(SplitPoint(edge));
    for (const int32_t t : sides) SplitTriangle(t, edge, middle);
    for (const int32_t end : {edge.first, edge.second}) {
      for (const int32_t apex : apexes) suspects_.push_back(EdgeOf(end, apex));
    }
    MakeDelaunay();
  }

  /// The point that divides the smallest sufficient number of equal parts into two halves; an odd
  /// part belongs to the second half.
  Point SplitPoint(const Edge& edge) const {
    const Point &a = Vertex(edge.first), &b = Vertex(edge.second);
    const double parts = std::ceil(RelativeLength(edge) / (kPartLength * max_edge_m_) - kRounding);
    const double t = parts < 2 ? 0.5 : std::floor(parts / 2) / parts;
    return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
  }

  /// Triangle `t` keeps the half that ends in edge.first; a new one takes the other.
  void SplitTriangle(int32_t t, const Edge& edge, int32_t middle) {
    const int32_t apex = Apex(t, edge);
    auto near_half = Triangle(t), far_half = near_half;
    std::ranges::replace(near_half, edge.second, middle);
    std::ranges::replace(far_half, edge.first, middle);
    const auto added = static_cast<int32_t>(refined_.surface.triangles.size());
    Triangle(t) = near_half;
    refined_.surface.triangles.push_back(far_half);
    refined_.given_triangle.push_back(Given(t));
    Reattach(EdgeOf(edge.second, apex), t, added);
    Attach(EdgeOf(edge.first, middle), t);
    Attach(EdgeOf(edge.second, middle), added);
    Attach(EdgeOf(apex, middle), t);
    Attach(EdgeOf(apex, middle), added);
  }

  void MakeDelaunay() {
    while (!suspects_.empty()) {
      const Edge edge = suspects_.back();
      suspects_.pop_back();
      const auto found = triangles_of_edge_.find(edge);
      if (found != triangles_of_edge_.end() && IsInside(found->second)) FlipIfNotDelaunay(edge);
    }
  }

  /// The angles that face a Delaunay edge sum to at most pi.
  void FlipIfNotDelaunay(const Edge& edge) {
    const Sides& sides = triangles_of_edge_.at(edge);
    const int32_t c = Apex(sides[0], edge), d = Apex(sides[1], edge);
    const Point ca = Difference(Vertex(edge.first), Vertex(c));
    const Point cb = Difference(Vertex(edge.second), Vertex(c));
    const Point da = Difference(Vertex(edge.first), Vertex(d));
    const Point db = Difference(Vertex(edge.second), Vertex(d));
    const double sine_of_sum =
        Norm(Cross(ca, cb)) * Dot(da, db) + Dot(ca, cb) * Norm(Cross(da, db));
    const double lengths = Norm(ca) * Norm(cb) * Norm(da) * Norm(db);
    if (sine_of_sum < -kFlipTolerance * lengths) Flip(edge, {c, d});
  }

  void Flip(const Edge& edge, const Edge& apexes) {
    const Sides sides = triangles_of_edge_.at(edge);
    triangles_of_edge_.erase(edge);
    std::ranges::replace(Triangle(sides[0]), edge.second, apexes.second);
    std::ranges::replace(Triangle(sides[1]), edge.first, apexes.first);
    Reattach(EdgeOf(edge.second, apexes.first), sides[0], sides[1]);
    Reattach(EdgeOf(edge.first, apexes.second), sides[1], sides[0]);
    for (const int32_t t : sides) Attach(EdgeOf(apexes.first, apexes.second), t);
    for (const int32_t end : {edge.first, edge.second}) {
      for (const int32_t apex : {apexes.first, apexes.second})
        suspects_.push_back(EdgeOf(end, apex));
    }
  }

  // Below this difference, rounding in a square cell could flip its diagonal again and again.
  static constexpr double kFlipTolerance = 1e-9;

  // Parts are shorter than the limit by this factor, because the diagonals between the cuts of a
  // narrow triangle are longer than the parts.
  static constexpr double kPartLength = 0.93;
  static constexpr double kRounding = 1e-9;  // makes no part more

  double max_edge_m_;
  const SizeField& relative_size_;
  bool edges_inside_too_ = false;
  RefinedSurface refined_;
  absl::flat_hash_map<Edge, Sides> triangles_of_edge_;
  // By relative length, then by vertices, so that the same surface is always split alike.
  std::priority_queue<std::tuple<double, int32_t, int32_t>> long_edges_;
  std::vector<Edge> suspects_;
};

}  // namespace

RefinedSurface RefineSurface(const SurfaceMesh& surface, double max_edge_m,
                             const SizeField& relative_size) {
  return Refiner(surface, max_edge_m, relative_size).Refine();
}

}  // namespace carillon::precompute
