// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_curvature.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace carillon {
namespace {

constexpr double kSharpAngle = 50 * std::numbers::pi / 180;
/// Number of times that the curvature of a triangle is averaged with that of its neighbours.
constexpr int kAveragings = 2;

Point Minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double Dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point Cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double Length(const Point& a) { return std::sqrt(Dot(a, a)); }

/// An edge of a triangle. Two triangles that share an edge are found by its two vertices.
struct Edge {
  uint32_t low = 0, high = 0;
  uint32_t triangle = 0;
  uint8_t side = 0;  ///< the edge from corner `side` to the next
  bool SameAs(const Edge& other) const { return low == other.low && high == other.high; }
};

/// The integral of the mean curvature over some triangles, and their area.
struct Integral {
  double curvature_m = 0;
  double area_m2 = 0;
};

double DistanceFromSegment(const Point& point, const Point& a, const Point& b) {
  const Point along = Minus(b, a), from = Minus(point, a);
  const double square = Dot(along, along);
  const double share = square > 0 ? std::clamp(Dot(from, along) / square, 0.0, 1.0) : 0;
  const Point foot = {a[0] + share * along[0], a[1] + share * along[1], a[2] + share * along[2]};
  return Length(Minus(point, foot));
}

/// The surface while its curvature is computed.
class Facets {
 public:
  Facets(std::span<const std::array<float, 3>> vertices,
         std::span<const std::array<uint32_t, 3>> triangles)
      : vertices_(vertices), triangles_(triangles), sharp_(triangles.size(), 0) {
    integrals_.reserve(triangles.size());
    normals_.reserve(triangles.size());
    for (const auto& [a, b, c] : triangles) {
      const Point normal = Cross(Minus(At(b), At(a)), Minus(At(c), At(a)));
      const double twice_area = Length(normal);
      integrals_.push_back({.area_m2 = twice_area / 2});
      volume_ += Dot(normal, At(a));
      const double scale = twice_area > 0 ? 1 / twice_area : 0;
      normals_.push_back({normal[0] * scale, normal[1] * scale, normal[2] * scale});
    }
    FindNeighbours();
  }

  std::vector<float> MeanCurvatures() {
    for (int i = 0; i < kAveragings; ++i) Average();
    std::vector<float> curvatures;
    curvatures.reserve(integrals_.size());
    for (const Integral& integral : integrals_) {
      const double curvature = integral.area_m2 > 0 ? integral.curvature_m / integral.area_m2 : 0;
      curvatures.push_back(static_cast<float>(curvature));
    }
    return curvatures;
  }

  std::vector<uint8_t>& sharp() { return sharp_; }

 private:
  Point At(uint32_t vertex) const {
    const std::array<float, 3>& v = vertices_[vertex];
    return {v[0], v[1], v[2]};
  }

  std::vector<Edge> SortedEdges() const {
    std::vector<Edge> edges;
    edges.reserve(3 * triangles_.size());
    for (uint32_t t = 0; t < triangles_.size(); ++t) {
      for (uint8_t side = 0; side < 3; ++side) {
        const auto [low, high] = std::minmax({triangles_[t][side], triangles_[t][(side + 1) % 3]});
        edges.push_back({low, high, t, side});
      }
    }
    std::ranges::sort(edges, [](const Edge& a, const Edge& b) {
      return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    return edges;
  }

  void FindNeighbours() {
    const std::vector<Edge> edges = SortedEdges();
    for (size_t i = 0; i < edges.size();) {
      size_t end = i + 1;
      while (end < edges.size() && edges[end].SameAs(edges[i])) ++end;
      if (end - i == 2) {
        Meet(edges[i], edges[i + 1]);
      } else {
        for (size_t k = i; k < end; ++k) MarkSharp(edges[k]);
      }
      i = end;
    }
  }

  void MarkSharp(const Edge& edge) {
    sharp_[edge.triangle] = static_cast<uint8_t>(sharp_[edge.triangle] | (1U << edge.side));
  }

  /// Adds the angle between two neighbours, which is positive where the body is convex, to their
  /// curvature, or marks their edge as sharp.
  void Meet(const Edge& a, const Edge& b) {
    const std::array<uint32_t, 3>& corners = triangles_[a.triangle];
    const Point edge = Minus(At(corners[(a.side + 1U) % 3]), At(corners[a.side]));
    const Point &first = normals_[a.triangle], &second = normals_[b.triangle];
    const double length = Length(edge);
    const double sine = length > 0 ? Dot(Cross(first, second), edge) / length : 0;
    // The angle changes sign if the triangles face inwards.
    const double angle = std::atan2(sine, Dot(first, second)) * (volume_ < 0 ? -1 : 1);
    if (std::abs(angle) < kSharpAngle) {
      for (const Edge& side : {a, b}) {
        integrals_[side.triangle].curvature_m += length * angle / 4;
      }
      neighbours_.push_back({a.triangle, b.triangle});
    } else if (angle > 0) {
      MarkSharp(a);
      MarkSharp(b);
    }
  }

  void Average() {
    const std::vector<Integral> before = integrals_;
    const auto add = [](const Integral& from, Integral& to) {
      to.curvature_m += from.curvature_m;
      to.area_m2 += from.area_m2;
    };
    for (const auto& [a, b] : neighbours_) {
      add(before[a], integrals_[b]);
      add(before[b], integrals_[a]);
    }
  }

  std::span<const std::array<float, 3>> vertices_;
  std::span<const std::array<uint32_t, 3>> triangles_;
  std::vector<Point> normals_;  // unit vectors
  double volume_ = 0;           // six times the volume; negative if the triangles face inwards
  std::vector<Integral> integrals_;
  std::vector<std::array<uint32_t, 2>> neighbours_;  // triangles on both sides of smooth edges
  std::vector<uint8_t> sharp_;
};

}  // namespace

SurfaceCurvature::SurfaceCurvature(std::span<const std::array<float, 3>> vertices,
                                   std::span<const std::array<uint32_t, 3>> triangles)
    : vertices_(vertices), triangles_(triangles) {
  Facets facets(vertices, triangles);
  curvature_per_m_ = facets.MeanCurvatures();
  sharp_sides_ = std::move(facets.sharp());
  FindCorners();
}

void SurfaceCurvature::FindCorners() {
  sharpness_.resize(vertices_.size());
  std::vector<Point> along(vertices_.size());  // the first sharp edge of a vertex, as a unit vector
  for (const auto& [from, to] : sharp_edges()) {
    Point edge{};
    for (size_t i = 0; i < 3; ++i) edge[i] = double{vertices_[to][i]} - vertices_[from][i];
    const double length = Length(edge);
    for (double& x : edge) x /= length > 0 ? length : 1;
    for (const uint32_t vertex : {from, to}) {
      const bool bends = std::abs(Dot(along[vertex], edge)) < std::cos(kSharpAngle);
      if (sharpness_[vertex] == 0) {
        sharpness_[vertex] = kEdge;
        along[vertex] = edge;
      } else if (bends) {
        sharpness_[vertex] = kCorner;
      }
    }
  }
}

double SurfaceCurvature::At(uint32_t triangle, const Point& point, double size) const {
  if (triangle >= triangles_.size()) return 0;
  const std::array<uint32_t, 3>& vertices = triangles_[triangle];
  std::array<Point, 3> corners;
  for (size_t i = 0; i < 3; ++i) {
    const std::array<float, 3>& vertex = vertices_[vertices[i]];
    corners[i] = {vertex[0], vertex[1], vertex[2]};
  }
  // Which of the triangles that meet at an edge or corner is the nearest is up to rounding.
  uint8_t sharpness = 0;
  for (size_t i = 0; i < 3; ++i) {
    if (Length(Minus(point, corners[i])) * size <= kEdgeRadiusM) {
      sharpness = std::max(sharpness, sharpness_[vertices[i]]);
    }
    if ((sharp_sides_[triangle] >> i & 1) == 0) continue;
    if (DistanceFromSegment(point, corners[i], corners[(i + 1) % 3]) * size <= kEdgeRadiusM) {
      sharpness = std::max(sharpness, kEdge);
    }
  }
  const double round = curvature_per_m_[triangle] / size;
  return std::clamp(std::max(round, sharpness * 0.5 / kEdgeRadiusM), -1 / kEdgeRadiusM,
                    1 / kEdgeRadiusM);
}

std::vector<std::array<uint32_t, 2>> SurfaceCurvature::sharp_edges() const {
  std::vector<std::array<uint32_t, 2>> edges;
  for (size_t t = 0; t < triangles_.size(); ++t) {
    for (size_t side = 0; side < 3; ++side) {
      if ((sharp_sides_[t] >> side & 1) == 0) continue;
      const auto [low, high] = std::minmax({triangles_[t][side], triangles_[t][(side + 1) % 3]});
      edges.push_back({low, high});
    }
  }
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace carillon
