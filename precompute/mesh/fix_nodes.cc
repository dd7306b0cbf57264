// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fix_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "precompute/mesh/point_math.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

constexpr double kTolerance = 1e-6;  // of the body's diagonal
constexpr size_t kMaxNamesTold = 20;

double DistanceToSegment(const Point& p, const Point& a, const Point& b) {
  const Point along = Difference(b, a);
  const double length2 = Dot(along, along);
  const double t = length2 == 0 ? 0 : std::clamp(Dot(Difference(p, a), along) / length2, 0.0, 1.0);
  return Distance(p, {a[0] + t * along[0], a[1] + t * along[1], a[2] + t * along[2]});
}

absl::Status NoNodeFixed(absl::string_view by, absl::string_view repair) {
  return Refusal(absl::StatusCode::kInvalidArgument, "NO_VERTEX_FIXED",
                 absl::StrCat("no node of the body is fixed by ", by, ": ", repair));
}

/// Finds the node nearest to a place.
class NearestNode {
 public:
  explicit NearestNode(const std::vector<Point>& nodes) : nodes_(nodes), by_x_(nodes.size()) {
    for (size_t n = 0; n < nodes.size(); ++n) by_x_[n] = static_cast<int32_t>(n);
    std::ranges::sort(by_x_, {}, [&](int32_t n) { return At(n)[0]; });
  }

  int32_t Find(const Point& p) const {
    const auto start =
        std::ranges::lower_bound(by_x_, p[0], {}, [&](int32_t n) { return At(n)[0]; });
    Nearest nearest;
    for (auto it = start; it != by_x_.end() && At(*it)[0] - p[0] < nearest.distance; ++it) {
      Look(*it, p, nearest);
    }
    for (auto it = start; it != by_x_.begin() && p[0] - At(*(it - 1))[0] < nearest.distance; --it) {
      Look(*(it - 1), p, nearest);
    }
    return nearest.node;
  }

 private:
  struct Nearest {
    int32_t node = 0;
    double distance = HUGE_VAL;
  };

  const Point& At(int32_t n) const { return nodes_[static_cast<size_t>(n)]; }

  void Look(int32_t n, const Point& p, Nearest& nearest) const {
    const double distance = Distance(At(n), p);
    if (distance < nearest.distance) nearest = {n, distance};
  }

  const std::vector<Point>& nodes_;
  std::vector<int32_t> by_x_;
};

/// Marks nodes, fixture by fixture.
class FixedNodeFinder {
 public:
  FixedNodeFinder(const SurfaceMesh& given, const MeshNames& names, const TetMesh& mesh)
      : given_(given),
        names_(names),
        mesh_(mesh),
        tolerance_m_(kTolerance * Diagonal(mesh.nodes)),
        is_fixed_(mesh.nodes.size()) {}

  absl::Status operator()(const FixedPlane& plane) {
    const double length = Norm(plane.normal);
    const Point point = Difference(plane.point_m, names_.origin_m);
    FixWhere([&](const Point& p) {
      return Dot(Difference(p, point), plane.normal) <= tolerance_m_ * length;
    });
    if (any_) return absl::OkStatus();
    return NoNodeFixed("the plane",
                       "it leaves all of the body on the side of its normal; move its point, in "
                       "metres, or turn its normal, which points to the free side");
  }

  absl::Status operator()(const FixedBox& box) {
    const Point low = Difference(box.low_m, names_.origin_m);
    const Point high = Difference(box.high_m, names_.origin_m);
    FixWhere([&](const Point& p) {
      bool inside = true;
      for (size_t x = 0; x < 3; ++x) {
        inside = inside && p[x] >= low[x] - tolerance_m_ && p[x] <= high[x] + tolerance_m_;
      }
      return inside;
    });
    if (any_) return absl::OkStatus();
    return NoNodeFixed("the box",
                       "it lies beside the body or between its nodes; its corners are "
                       "in metres, of the body as large as its unit makes it");
  }

  absl::Status operator()(const FixedVertices& vertices) {
    absl::flat_hash_set<Point> places;
    const NearestNode nearest(mesh_.nodes);
    for (const int64_t number : vertices.numbers) {
      const auto found = names_.vertices.find(number);
      if (found == names_.vertices.end()) return NoSuchVertex(number);
      places.insert(found->second);
      Mark(nearest.Find(found->second));
    }
    FixBetween(places);
    return absl::OkStatus();
  }

  absl::Status operator()(const FixedGroup& asked) {
    const auto group = std::ranges::find(names_.groups, asked.name, &MeshGroup::name);
    if (group == names_.groups.end()) return NoSuchGroup(asked.name);
    FixTriangles(*group);
    FixSimplices(*group);
    if (any_) return absl::OkStatus();
    return NoNodeFixed(
        absl::StrCat("the group ", QuotedText(asked.name)),
        "no part of it is on the boundary of the body; name another group, a plane or a box");
  }

  absl::Status Take(const Fixture& fixture) {
    any_ = false;
    return std::visit(*this, fixture);
  }

  absl::StatusOr<std::vector<int32_t>> Nodes() const {
    if (std::ranges::all_of(is_fixed_, [](bool fixed) { return fixed; })) {
      return Refusal(absl::StatusCode::kInvalidArgument, "ALL_VERTICES_FIXED",
                     "all nodes of the body are fixed, so that nothing can vibrate: fix less of it "
                     "(the normal of a plane points to the free side)");
    }
    std::vector<int32_t> nodes;
    for (size_t n = 0; n < is_fixed_.size(); ++n) {
      if (is_fixed_[n]) nodes.push_back(static_cast<int32_t>(n));
    }
    return nodes;
  }

 private:
  void Mark(int32_t node) {
    if (node < 0) return;
    is_fixed_[static_cast<size_t>(node)] = true;
    any_ = true;
  }

  template <typename Condition>
  void FixWhere(const Condition& holds) {
    for (size_t n = 0; n < mesh_.nodes.size(); ++n) {
      if (holds(mesh_.nodes[n])) Mark(static_cast<int32_t>(n));
    }
  }

  /// Nodes on given triangles and edges whose corners are all among `places`.
  void FixBetween(const absl::flat_hash_set<Point>& places) {
    for (const BoundaryFace& face : mesh_.boundary) {
      std::vector<Point> corners;
      for (const int32_t v : given_.triangles[static_cast<size_t>(face.given_triangle)]) {
        const Point& p = given_.vertices[static_cast<size_t>(v)];
        if (places.contains(p)) corners.push_back(p);
      }
      if (corners.size() < 2) continue;
      for (const int32_t node : face.nodes) {
        const bool between =
            corners.size() == 3 ||
            (node >= 0 && DistanceToSegment(mesh_.nodes[static_cast<size_t>(node)], corners[0],
                                            corners[1]) <= tolerance_m_);
        if (between) Mark(node);
      }
    }
  }

  void FixTriangles(const MeshGroup& group) {
    const absl::flat_hash_set<int32_t> triangles(group.triangles.begin(), group.triangles.end());
    for (const BoundaryFace& face : mesh_.boundary) {
      if (!triangles.contains(face.given_triangle)) continue;
      for (const int32_t node : face.nodes) Mark(node);
    }
  }

  using Edges = absl::flat_hash_set<std::pair<int32_t, int32_t>>;

  /// A group of nodes stands for the part of the boundary between these nodes.
  void AddEdgesBetweenPoints(const MeshGroup& group, Edges& edges) const {
    absl::flat_hash_set<int32_t> points;
    for (const auto& corners : group.simplices) {
      if (corners[1] < 0) points.insert(corners[0]);
    }
    for (const BoundaryFace& face : mesh_.boundary) {
      for (size_t i = 0; i < 3; ++i) {
        const int32_t a = face.nodes[i], b = face.nodes[(i + 1) % 3];
        if (points.contains(a) && points.contains(b)) edges.insert(std::minmax(a, b));
      }
    }
  }

  /// Corners, and the mid-side nodes of the edges between the corners of one simplex, or between
  /// points.
  void FixSimplices(const MeshGroup& group) {
    Edges edges;
    for (const auto& corners : group.simplices) {
      for (size_t i = 0; i < corners.size() && corners[i] >= 0; ++i) {
        Mark(corners[i]);
        for (size_t j = 0; j < i; ++j) edges.insert(std::minmax(corners[i], corners[j]));
      }
    }
    if (mesh_.nodes_per_element != 10) return;
    AddEdgesBetweenPoints(group, edges);
    for (size_t e = 0; e < mesh_.elements.size(); e += 10) {
      const int32_t* element = &mesh_.elements[e];
      for (size_t k = 0; k < kTetEdges.size(); ++k) {
        const int32_t a = element[kTetEdges[k][0]], b = element[kTetEdges[k][1]];
        if (edges.contains(std::minmax(a, b))) Mark(element[4 + k]);
      }
    }
  }

  absl::Status NoSuchVertex(int64_t number) const {
    if (names_.vertices.empty()) {
      return NoNodeFixed(absl::StrCat("vertex ", number),
                         "files of this format do not number vertices; fix a plane or a box");
    }
    int64_t least = number, most = number;
    bool first = true;
    for (const auto& [n, place] : names_.vertices) {
      least = first ? n : std::min(least, n);
      most = first ? n : std::max(most, n);
      first = false;
    }
    return NoNodeFixed(absl::StrCat("vertex ", number),
                       absl::StrCat("the numbers of the file go from ", least, " to ", most));
  }

  absl::Status NoSuchGroup(const std::string& name) const {
    std::vector<std::string> known;
    for (const MeshGroup& group : names_.groups) known.push_back(QuotedText(group.name));
    std::ranges::sort(known);
    const size_t told = std::min(known.size(), kMaxNamesTold);
    const std::string list =
        absl::StrJoin(known.begin(), known.begin() + static_cast<ptrdiff_t>(told), ", ");
    return Refusal(absl::StatusCode::kInvalidArgument, "GROUP_UNKNOWN",
                   absl::StrCat("the mesh file has no group ", QuotedText(name), ": ",
                                known.empty() ? "it names none; fix a plane or a box"
                                              : absl::StrCat("it has ", list,
                                                             told < known.size() ? ", ..." : "")));
  }

  const SurfaceMesh& given_;
  const MeshNames& names_;
  const TetMesh& mesh_;
  double tolerance_m_;
  std::vector<bool> is_fixed_;
  bool any_ = false;  // whether the current fixture has fixed a node
};

}  // namespace

absl::Status FixNodes(const std::vector<Fixture>& fixtures, const SurfaceMesh& given,
                      const MeshNames& names, TetMesh& mesh) {
  mesh.fixed.clear();
  if (fixtures.empty()) return absl::OkStatus();
  FixedNodeFinder finder(given, names, mesh);
  for (const Fixture& fixture : fixtures) {
    RETURN_IF_ERROR(finder.Take(fixture));
  }
  ASSIGN_OR_RETURN(mesh.fixed, finder.Nodes());
  return absl::OkStatus();
}

}  // namespace carillon::precompute
