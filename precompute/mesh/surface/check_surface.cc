// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/check_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/mesh_limits.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/find_overlaps.h"
#include "precompute/mesh/surface/find_self_intersection.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Corners = std::array<int32_t, 3>;

absl::Status Refuse(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

std::string Show(const Point& p) { return absl::StrCat("(", p[0], ", ", p[1], ", ", p[2], ") m"); }

const Point& VertexAt(const SurfaceMesh& surface, int32_t v) {
  return surface.vertices[static_cast<size_t>(v)];
}

std::string ShowTriangle(const SurfaceMesh& surface, size_t t) {
  return absl::StrCat("triangle ", t, " at ", Show(VertexAt(surface, surface.triangles[t][0])));
}

absl::Status CheckSize(const SurfaceMesh& surface) {
  if (surface.triangles.empty()) {
    return Refuse("MESH_EMPTY",
                  "the surface has no triangles: export the body as triangles or polygons");
  }
  if (surface.triangles.size() > kMaxSurfaceTriangles) {
    return Refusal(
        absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
        absl::StrCat("the surface has ", surface.triangles.size(), " triangles; the limit is ",
                     kMaxSurfaceTriangles, ": decimate it"));
  }
  return absl::OkStatus();
}

absl::Status CheckIndices(const SurfaceMesh& surface) {
  const auto count = static_cast<int32_t>(surface.vertices.size());
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    for (const int32_t v : surface.triangles[t]) {
      if (v >= 0 && v < count) continue;
      return Refuse("MESH_INDEX_OUT_OF_RANGE",
                    absl::StrCat("triangle ", t, " names vertex ", v, " of ", count,
                                 " (counted from zero): export the mesh again"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckFinite(const SurfaceMesh& surface) {
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    const Point& p = surface.vertices[v];
    if (std::ranges::all_of(p, [](double x) { return std::isfinite(x); })) continue;
    return Refuse("MESH_NOT_FINITE", absl::StrCat("vertex ", v, " (counted from zero) lies at ",
                                                  Show(p), ": give it finite coordinates"));
  }
  return absl::OkStatus();
}

/// Whether an odd number of exchanges sorts the corners. Of two triangles with the same corners,
/// one of which is odd, the normals point against each other.
bool IsOdd(const Corners& c) { return ((c[0] > c[1]) != (c[1] > c[2])) != (c[0] > c[2]); }

/// Two triangles with the same corners: a wall that two closed shells share, or a shell that is
/// there twice.
absl::Status CheckDuplicates(const SurfaceMesh& surface) {
  absl::flat_hash_map<Corners, size_t> triangle_of_corners;
  triangle_of_corners.reserve(surface.triangles.size());
  size_t duplicate_count = 0, opposite_count = 0;
  std::pair<size_t, size_t> first;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    Corners corners = surface.triangles[t];
    if (IsCollapsed(corners)) continue;
    std::ranges::sort(corners);
    const auto [found, is_new] = triangle_of_corners.try_emplace(corners, t);
    if (is_new) continue;
    if (duplicate_count++ == 0) first = {found->second, t};
    if (IsOdd(surface.triangles[found->second]) != IsOdd(surface.triangles[t])) ++opposite_count;
  }
  if (duplicate_count == 0) return absl::OkStatus();
  const bool touch =
      opposite_count == duplicate_count && 2 * duplicate_count < surface.triangles.size();
  return Refuse(
      "MESH_DUPLICATE_SHELL",
      absl::StrCat(duplicate_count,
                   " triangles lie on another with the same corners, first triangles ", first.first,
                   " and ", first.second, " at ",
                   Show(VertexAt(surface, surface.triangles[first.first][0])),
                   touch ? ", because closed shells touch there: unite the shells, or make each an "
                           "object, material or solid of its own, from which one body is made"
                         : ": keep one shell of those that are there twice"));
}

/// Number of triangles that use an edge from its smaller to its larger vertex, and in the opposite
/// direction.
struct EdgeUse {
  int along = 0;
  int against = 0;
};

using EdgeUses = absl::flat_hash_map<std::pair<int32_t, int32_t>, EdgeUse>;

EdgeUses CountEdges(const SurfaceMesh& surface) {
  EdgeUses uses;
  uses.reserve(surface.triangles.size() * 3 / 2);
  for (const Corners& corner : surface.triangles) {
    if (IsCollapsed(corner)) continue;
    for (size_t i = 0; i < 3; ++i) {
      const int32_t a = corner[i], b = corner[(i + 1) % 3];
      EdgeUse& use = uses[{std::min(a, b), std::max(a, b)}];
      ++(a < b ? use.along : use.against);
    }
  }
  return uses;
}

/// The first matching edge in the order of the vertices, and the number of matching edges.
struct BadEdges {
  size_t count = 0;
  std::pair<int32_t, int32_t> first;
};

template <typename Fits>
BadEdges FindEdges(const EdgeUses& uses, Fits fits) {
  BadEdges bad;
  for (const auto& [edge, use] : uses) {
    if (!fits(use)) continue;
    if (bad.count++ == 0 || edge < bad.first) bad.first = edge;
  }
  return bad;
}

std::string ShowEdge(const SurfaceMesh& surface, const std::pair<int32_t, int32_t>& edge) {
  return absl::StrCat("from ", Show(VertexAt(surface, edge.first)), " to ",
                      Show(VertexAt(surface, edge.second)));
}

absl::Status CheckEdges(const SurfaceMesh& surface) {
  const EdgeUses uses = CountEdges(surface);
  const BadEdges crowded =
      FindEdges(uses, [](const EdgeUse& use) { return use.along + use.against > 2; });
  if (crowded.count > 0) {
    return Refuse("MESH_NOT_MANIFOLD",
                  absl::StrCat(crowded.count, " edges have more than two triangles, first the one ",
                               ShowEdge(surface, crowded.first),
                               ": remove inner walls, and separate bodies that touch"));
  }
  const BadEdges open =
      FindEdges(uses, [](const EdgeUse& use) { return use.along + use.against == 1; });
  if (open.count > 0) {
    return Refuse("MESH_NOT_CLOSED",
                  absl::StrCat("the surface has ", open.count, " open edges, first the one ",
                               ShowEdge(surface, open.first),
                               ": close its holes, and give thin sheets a thickness"));
  }
  const BadEdges mixed = FindEdges(uses, [](const EdgeUse& use) { return use.along != 1; });
  if (mixed.count > 0) {
    return Refuse("MESH_NOT_ORIENTED",
                  absl::StrCat("the triangles on both sides of ", mixed.count,
                               " edges are turned against each other, first at the edge ",
                               ShowEdge(surface, mixed.first),
                               ": recalculate the normals so that all point outward"));
  }
  return absl::OkStatus();
}

/// Smallest accepted volume of a body, relative to the cube around it. A square metre of foil a
/// tenth of a micrometre thick has a hundred thousand times this volume.
constexpr double kMinVolumePart = 1e-12;

absl::Status CheckVolume(const SurfaceMesh& surface, const std::vector<Shell>& shells) {
  double size = 0;
  for (const Point& p : surface.vertices) {
    size = std::max(size, Distance(p, surface.vertices.front()));
  }
  for (const Shell& shell : shells) {
    if (std::abs(shell.volume_m3) > kMinVolumePart * size * size * size) continue;
    return Refuse("MESH_ZERO_VOLUME",
                  absl::StrCat("the shell with ",
                               ShowTriangle(surface, static_cast<size_t>(shell.triangles.front())),
                               " encloses no volume: give it a thickness or remove it"));
  }
  if (!shells.empty()) return absl::OkStatus();
  return Refuse("MESH_ZERO_VOLUME",
                "all triangles have shrunk to lines or points: check the unit "
                "and the precision of the export");
}

absl::Status CheckCrossings(const SurfaceMesh& surface) {
  const std::optional<SurfaceDefect> defect = FindSelfIntersection(surface);
  if (!defect) return absl::OkStatus();
  const std::string where = ShowTriangle(surface, static_cast<size_t>(defect->first));
  switch (defect->kind) {
    case SurfaceDefect::Kind::kFlatTriangle:
      return Refuse("MESH_DEGENERATE_TRIANGLE",
                    absl::StrCat(where,
                                 " has its corners on one line: collapse its shortest edge "
                                 "or flip its longest"));
    case SurfaceDefect::Kind::kPinched:
      return Refuse("MESH_NOT_MANIFOLD",
                    absl::StrCat(where,
                                 " has a corner at which parts of the surface only touch: "
                                 "join them along faces or separate them"));
    case SurfaceDefect::Kind::kSelfIntersecting:
      break;
  }
  return Refuse("MESH_SELF_INTERSECTING",
                absl::StrCat(where, " crosses or touches ",
                             ShowTriangle(surface, static_cast<size_t>(defect->second)),
                             ": unite bodies that overlap, and pull apart walls that cross"));
}

absl::Status CheckOverlaps(const SurfaceMesh& surface) {
  const auto overlaps = FindOverlaps(surface, 1);
  if (overlaps.empty()) return absl::OkStatus();
  const auto& [first, second] = overlaps.front();
  return Refuse("MESH_SELF_INTERSECTING",
                absl::StrCat(ShowTriangle(surface, static_cast<size_t>(first)), " lies on ",
                             ShowTriangle(surface, static_cast<size_t>(second)),
                             " except for rounding: unfold the surface there, and separate or "
                             "unite walls that touch"));
}

bool IsInside(const SurfaceMesh& surface, const Shell& inner, const Shell& outer) {
  const Point middle = MiddleOf(CornersOf(surface, static_cast<size_t>(inner.triangles.front())));
  return std::abs(WindingNumber(surface, outer, middle)) > 0.5;
}

/// All shells but the first, largest one must be cavities in it, side by side, oriented against it.
absl::Status CheckNesting(const SurfaceMesh& surface, const std::vector<Shell>& shells) {
  if (shells.size() > kMaxShells) {
    return Refusal(
        absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
        absl::StrCat("the surface has ", shells.size(), " separate shells; the limit is ",
                     kMaxShells, ": remove loose triangles and the smallest cavities"));
  }
  for (size_t s = 1; s < shells.size(); ++s) {
    const std::string where =
        ShowTriangle(surface, static_cast<size_t>(shells[s].triangles.front()));
    bool is_cavity = IsInside(surface, shells[s], shells[0]);
    for (size_t other = 1; other < s && is_cavity; ++other) {
      is_cavity = !IsInside(surface, shells[s], shells[other]);
    }
    if (!is_cavity) {
      return Refuse("MESH_SEVERAL_PIECES",
                    absl::StrCat("the surface bounds several bodies that do not touch, one with ",
                                 where, ": submit each as a mesh of its own, or join them"));
    }
    if ((shells[s].volume_m3 > 0) == (shells[0].volume_m3 > 0)) {
      return Refuse("MESH_NOT_ORIENTED",
                    absl::StrCat("the shell with ", where,
                                 " lies inside another and is turned like it: turn it round if it "
                                 "is the wall of a cavity, remove it if not"));
    }
  }
  return absl::OkStatus();
}

std::vector<std::string> FindWarnings(const SurfaceMesh& surface,
                                      const std::vector<Shell>& shells) {
  std::vector<std::string> warnings;
  const auto collapsed = std::ranges::count_if(surface.triangles, IsCollapsed);
  if (collapsed > 0) {
    warnings.push_back(absl::StrCat("passed over with two equal corners: ", collapsed,
                                    collapsed == 1 ? " triangle" : " triangles"));
  }
  if (shells.front().volume_m3 < 0) {
    warnings.emplace_back("the surface is inside out; it was taken as if it were not");
  }
  return warnings;
}

}  // namespace

absl::StatusOr<std::vector<std::string>> CheckSurface(const SurfaceMesh& surface) {
  for (const auto check : {CheckSize, CheckIndices, CheckFinite, CheckDuplicates, CheckEdges}) {
    RETURN_IF_ERROR(check(surface));
  }
  const std::vector<Shell> shells = FindShells(surface);
  RETURN_IF_ERROR(CheckVolume(surface, shells));
  RETURN_IF_ERROR(CheckCrossings(surface));
  RETURN_IF_ERROR(CheckOverlaps(surface));
  RETURN_IF_ERROR(CheckNesting(surface, shells));
  return FindWarnings(surface, shells);
}

}  // namespace carillon::precompute
