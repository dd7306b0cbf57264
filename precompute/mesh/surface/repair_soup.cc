// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/repair_soup.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

using Triangle = std::array<int32_t, 3>;
using Edge = std::pair<int32_t, int32_t>;

/// Part of the diagonal within which vertices are one.
constexpr double kWeldPart = 1e-6;
/// Longest rim, as a part of the diagonal, of a hole that is closed.
constexpr double kRimPart = 0.2;
/// Border edges are compared with border vertices one by one; beyond so many a wrap is faster.
constexpr size_t kMostBorderPairs = 50'000'000;
constexpr int kMostCutRounds = 64;

Edge Undirected(int32_t a, int32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// Joins what lies within `tolerance` of a vertex that came before.
class Welder {
 public:
  explicit Welder(double tolerance) : tolerance_(tolerance) {}

  int32_t Weld(const Point& p, std::vector<Point>& vertices) {
    const Cell cell = CellOf(p);
    for (int64_t x = -1; x <= 1; ++x) {
      for (int64_t y = -1; y <= 1; ++y) {
        for (int64_t z = -1; z <= 1; ++z) {
          const auto found = cells_.find({cell[0] + x, cell[1] + y, cell[2] + z});
          if (found == cells_.end()) continue;
          const Point& other = vertices[static_cast<size_t>(found->second)];
          if (Distance(p, other) <= tolerance_) return found->second;
        }
      }
    }
    const auto number = static_cast<int32_t>(vertices.size());
    vertices.push_back(p);
    cells_.try_emplace(cell, number);
    return number;
  }

 private:
  using Cell = std::array<int64_t, 3>;

  Cell CellOf(const Point& p) const {
    Cell cell;
    for (size_t i = 0; i < 3; ++i) cell[i] = std::llround(p[i] / tolerance_);
    return cell;
  }

  double tolerance_;
  absl::flat_hash_map<Cell, int32_t> cells_;
};

SurfaceMesh Weld(const SurfaceMesh& given, double tolerance) {
  SurfaceMesh welded;
  Welder welder(tolerance);
  std::vector<int32_t> number;
  for (const Point& p : given.vertices) number.push_back(welder.Weld(p, welded.vertices));
  for (const Triangle& triangle : given.triangles) {
    Triangle& corners = welded.triangles.emplace_back();
    for (size_t i = 0; i < 3; ++i) corners[i] = number[static_cast<size_t>(triangle[i])];
  }
  return welded;
}

size_t DropCollapsed(SurfaceMesh& surface) { return std::erase_if(surface.triangles, IsCollapsed); }

size_t DropDuplicates(SurfaceMesh& surface) {
  absl::flat_hash_set<Triangle> seen;
  return std::erase_if(surface.triangles, [&](Triangle triangle) {
    std::ranges::sort(triangle);
    return !seen.insert(triangle).second;
  });
}

/// The triangles at each edge.
using EdgeTriangles = absl::flat_hash_map<Edge, std::vector<size_t>>;

EdgeTriangles TrianglesAtEdges(const SurfaceMesh& surface) {
  EdgeTriangles edges;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const Triangle& c = surface.triangles[t];
    for (size_t i = 0; i < 3; ++i) edges[Undirected(c[i], c[(i + 1) % 3])].push_back(t);
  }
  return edges;
}

/// The vertices of edges that only one triangle has.
absl::flat_hash_set<int32_t> BorderVertices(const SurfaceMesh& surface) {
  absl::flat_hash_set<int32_t> border;
  for (const auto& [edge, triangles] : TrianglesAtEdges(surface)) {
    if (triangles.size() == 1) border.insert({edge.first, edge.second});
  }
  return border;
}

/// Joins vertices of the border that lie within `join_m`. Returns how many are gone.
size_t JoinBorders(SurfaceMesh& surface, double join_m) {
  const absl::flat_hash_set<int32_t> border = BorderVertices(surface);
  std::vector<int32_t> ordered(border.begin(), border.end());
  std::ranges::sort(ordered);
  Welder welder(join_m);
  std::vector<Point> joined;
  std::vector<int32_t> first_of;  // the vertex of the surface that each joined one is
  absl::flat_hash_map<int32_t, int32_t> replacement;
  for (const int32_t v : ordered) {
    const int32_t j = welder.Weld(surface.vertices[static_cast<size_t>(v)], joined);
    if (static_cast<size_t>(j) == first_of.size()) first_of.push_back(v);
    if (first_of[static_cast<size_t>(j)] != v) replacement[v] = first_of[static_cast<size_t>(j)];
  }
  for (Triangle& triangle : surface.triangles) {
    for (int32_t& v : triangle) {
      const auto found = replacement.find(v);
      if (found != replacement.end()) v = found->second;
    }
  }
  return replacement.size();
}

/// Where along a to b a point lies, 0 to 1, if within `tolerance` of it and not at an end.
double PlaceOn(const Point& a, const Point& b, const Point& p, double tolerance) {
  const Point along = Difference(b, a);
  const double place = Dot(Difference(p, a), along) / Dot(along, along);
  Point nearest;
  for (size_t i = 0; i < 3; ++i) nearest[i] = a[i] + place * along[i];
  const double length = Distance(a, b);
  const bool inside = place * length > tolerance && (1 - place) * length > tolerance;
  return inside && Distance(nearest, p) <= tolerance ? place : -1;
}

/// Cuts triangles in two at vertices of the border that lie on an edge of theirs; one cut a
/// triangle.
size_t CutAtTJunctions(SurfaceMesh& surface, double tolerance) {
  std::vector<std::pair<Edge, size_t>> border;
  absl::flat_hash_set<int32_t> corners;
  for (const auto& [edge, triangles] : TrianglesAtEdges(surface)) {
    if (triangles.size() != 1) continue;
    border.emplace_back(edge, triangles.front());
    corners.insert({edge.first, edge.second});
  }
  if (border.size() * corners.size() > kMostBorderPairs) return 0;
  std::ranges::sort(border);
  std::vector<int32_t> ordered(corners.begin(), corners.end());
  std::ranges::sort(ordered);
  const auto at = [&](int32_t v) { return surface.vertices[static_cast<size_t>(v)]; };
  absl::flat_hash_set<size_t> cut;
  for (const auto& at_border : border) {
    const Edge& edge = at_border.first;
    const size_t t = at_border.second;
    if (cut.contains(t)) continue;
    const auto on_edge = std::ranges::find_if(ordered, [&](int32_t v) {
      return std::ranges::find(surface.triangles[t], v) == surface.triangles[t].end() &&
             PlaceOn(at(edge.first), at(edge.second), at(v), tolerance) > 0;
    });
    if (on_edge == ordered.end()) continue;
    Triangle first = surface.triangles[t], second = first;
    std::ranges::replace(first, edge.first, *on_edge);
    std::ranges::replace(second, edge.second, *on_edge);
    surface.triangles[t] = first;
    surface.triangles.push_back(second);
    cut.insert(t);
  }
  return cut.size();
}

/// The rims of the holes: closed loops of border edges, each vertex of which is on one rim only. A
/// rim runs against the triangles at it.
std::vector<std::vector<int32_t>> FindRims(const SurfaceMesh& surface) {
  absl::flat_hash_map<int32_t, int32_t> next;
  absl::flat_hash_set<int32_t> crowded;
  const EdgeTriangles edges = TrianglesAtEdges(surface);
  for (const Triangle& c : surface.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const int32_t from = c[i], to = c[(i + 1) % 3];
      if (edges.at(Undirected(from, to)).size() != 1) continue;
      if (!next.try_emplace(to, from).second) crowded.insert(to);
    }
  }
  std::vector<int32_t> starts;
  for (const auto& [from, to] : next) starts.push_back(from);
  std::ranges::sort(starts);
  std::vector<std::vector<int32_t>> rims;
  absl::flat_hash_set<int32_t> seen;
  for (const int32_t start : starts) {
    std::vector<int32_t> rim;
    int32_t at = start;
    while (next.contains(at) && !crowded.contains(at) && seen.insert(at).second) {
      rim.push_back(at);
      at = next.at(at);
    }
    if (at == start && rim.size() >= 3) rims.push_back(rim);
  }
  return rims;
}

double LengthOf(const SurfaceMesh& surface, const std::vector<int32_t>& rim) {
  double length = 0;
  for (size_t i = 0; i < rim.size(); ++i) {
    length += Distance(surface.vertices[static_cast<size_t>(rim[i])],
                       surface.vertices[static_cast<size_t>(rim[(i + 1) % rim.size()])]);
  }
  return length;
}

/// Closes holes with short rims, by a fan about the middle of the rim.
size_t CloseHoles(SurfaceMesh& surface, double longest_rim_m) {
  size_t closed = 0;
  for (const std::vector<int32_t>& rim : FindRims(surface)) {
    if (LengthOf(surface, rim) > longest_rim_m) continue;
    ++closed;
    if (rim.size() == 3) {
      surface.triangles.push_back({rim[0], rim[1], rim[2]});
      continue;
    }
    Point middle = {0, 0, 0};
    for (const int32_t v : rim) {
      const Point& p = surface.vertices[static_cast<size_t>(v)];
      for (size_t i = 0; i < 3; ++i) middle[i] += p[i] / static_cast<double>(rim.size());
    }
    const auto hub = static_cast<int32_t>(surface.vertices.size());
    surface.vertices.push_back(middle);
    for (size_t i = 0; i < rim.size(); ++i) {
      surface.triangles.push_back({rim[i], rim[(i + 1) % rim.size()], hub});
    }
  }
  return closed;
}

bool RunsAlong(const Triangle& triangle, const Edge& edge) {
  for (size_t i = 0; i < 3; ++i) {
    if (triangle[i] == edge.first && triangle[(i + 1) % 3] == edge.second) return true;
  }
  return false;
}

void Turn(Triangle& triangle) { std::swap(triangle[1], triangle[2]); }

/// Turns triangles until neighbours agree, from the first of each connected part on.
size_t TurnToAgree(SurfaceMesh& surface) {
  const EdgeTriangles edges = TrianglesAtEdges(surface);
  std::vector<bool> seen(surface.triangles.size(), false);
  size_t turned = 0;
  for (size_t start = 0; start < surface.triangles.size(); ++start) {
    std::vector<size_t> waiting;
    if (!seen[start]) waiting.push_back(start);
    seen[start] = true;
    while (!waiting.empty()) {
      const size_t t = waiting.back();
      waiting.pop_back();
      const Triangle triangle = surface.triangles[t];
      for (size_t i = 0; i < 3; ++i) {
        const Edge edge(triangle[i], triangle[(i + 1) % 3]);
        const std::vector<size_t>& both = edges.at(Undirected(edge.first, edge.second));
        if (both.size() != 2) continue;
        const size_t other = both[0] == t ? both[1] : both[0];
        if (seen[other]) continue;
        seen[other] = true;
        waiting.push_back(other);
        if (!RunsAlong(surface.triangles[other], edge)) continue;
        Turn(surface.triangles[other]);
        ++turned;
      }
    }
  }
  return turned;
}

/// Turns whole shells: those inside an even number of others outward, the rest inward.
size_t TurnShells(SurfaceMesh& surface) {
  const std::vector<Shell> shells = FindShells(surface);
  std::vector<const Shell*> wrong;
  for (const Shell& shell : shells) {
    const Point middle = MiddleOf(CornersOf(surface, static_cast<size_t>(shell.triangles.front())));
    const auto depth = std::ranges::count_if(shells, [&](const Shell& other) {
      return &other != &shell && std::abs(WindingNumber(surface, other, middle)) > 0.5;
    });
    if ((shell.volume_m3 > 0) != (depth % 2 == 0)) wrong.push_back(&shell);
  }
  for (const Shell* shell : wrong) {
    for (const int32_t t : shell->triangles) Turn(surface.triangles[static_cast<size_t>(t)]);
  }
  return wrong.size();
}

bool Closed(const SurfaceMesh& surface) {
  return std::ranges::all_of(TrianglesAtEdges(surface),
                             [](const auto& edge) { return edge.second.size() == 2; });
}

}  // namespace

double JoinDistance(const SurfaceMesh& given) {
  constexpr double kPartOfEdge = 0.1, kPartOfDiagonal = 1e-3;
  const double diagonal = Diagonal(given.vertices);
  double shortest = diagonal;
  for (size_t t = 0; t < given.triangles.size(); ++t) {
    const auto corners = CornersOf(given, t);
    for (size_t i = 0; i < 3; ++i) {
      const double length = Distance(corners[i], corners[(i + 1) % 3]);
      if (length > kWeldPart * diagonal) shortest = std::min(shortest, length);
    }
  }
  return std::min(kPartOfEdge * shortest, kPartOfDiagonal * diagonal);
}

RepairedSurface RepairSoup(const SurfaceMesh& given, double join_m) {
  RepairedSurface repaired;
  const auto remark = [&](size_t count, absl::string_view what) {
    if (count > 0) repaired.remarks.push_back(absl::StrCat("repaired: ", count, " ", what));
  };
  const double diagonal = given.vertices.empty() ? 0 : Diagonal(given.vertices);
  if (!(diagonal > 0)) return {given, {}};
  const double tolerance = std::max(kWeldPart * diagonal, join_m);
  SurfaceMesh& surface = repaired.surface;
  surface = Weld(given, kWeldPart * diagonal);
  remark(given.vertices.size() - surface.vertices.size(), "vertices joined with others");
  if (join_m > 0) {
    remark(JoinBorders(surface, join_m),
           absl::StrFormat("corners of open edges joined with others up to %.3g m away", join_m));
  }
  remark(DropCollapsed(surface), "triangles without extent dropped");
  remark(DropDuplicates(surface), "triangles dropped that lay on others");
  size_t cut = 0;
  // A triangle may have several such vertices on its edges.
  for (int round = 0; round < kMostCutRounds; ++round) {
    const size_t more = CutAtTJunctions(surface, tolerance);
    cut += more;
    if (more == 0) break;
  }
  remark(cut, "triangles cut where a vertex lay on their edge");
  remark(DropDuplicates(surface), "triangles dropped that lay on others");
  remark(TurnToAgree(surface), "triangles turned round");
  constexpr size_t kMostShells = 1000;  // each is compared with each
  remark(CloseHoles(surface, kRimPart * diagonal), "holes closed");
  if (Closed(surface) && FindShells(surface).size() <= kMostShells) {
    remark(TurnShells(surface), "shells turned round");
  }
  return repaired;
}

}  // namespace carillon::precompute
