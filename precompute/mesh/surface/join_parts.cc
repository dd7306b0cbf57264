// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/join_parts.h"

#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/byte_stream.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/run_in_child.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/halfedge_mesh.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Corners = std::array<int32_t, 3>;
using Rim = std::vector<int32_t>;  // the vertices of a closed polygon

constexpr std::chrono::seconds kMostCpu(60);

absl::Status Explained(const absl::Status& refusal, absl::string_view what) {
  v1::ErrorInfo error = ToErrorInfo(refusal);
  error.set_message(absl::StrCat(what, ": ", error.message()));
  return FromErrorInfo(refusal.code(), error);
}

/// Returns the rims of an open surface, each with its smallest vertex first and in the direction of
/// the triangles. A vertex where two rims meet makes a rim that is passed over.
std::vector<Rim> RimsOf(const std::vector<Corners>& triangles) {
  std::set<std::pair<int32_t, int32_t>> edges;
  for (const Corners& corner : triangles) {
    for (size_t i = 0; i < 3; ++i) edges.emplace(corner[i], corner[(i + 1) % 3]);
  }
  std::map<int32_t, int32_t> next;
  for (const auto& [a, b] : edges) {
    if (!edges.contains({b, a})) next[a] = b;
  }
  std::vector<Rim> rims;
  while (!next.empty()) {
    Rim rim;
    for (auto at = next.begin(); at != next.end(); at = next.find(rim.back())) {
      rim.push_back(at->second);
      next.erase(at);
    }
    std::rotate(rim.begin(), std::ranges::min_element(rim), rim.end());
    rims.push_back(std::move(rim));
  }
  return rims;
}

Rim Reversed(Rim rim) {
  std::reverse(rim.begin() + 1, rim.end());
  return rim;
}

/// Returns triangles that close a rim, in its own direction, of the smallest area; none if there
/// are none.
std::vector<Corners> WallIn(const Rim& rim, const SurfaceMesh& surface) {
  const auto bytes = RunInChild(
      [&] {
        std::vector<HalfedgeKernel::Point_3> points;
        points.reserve(rim.size());
        for (const int32_t v : rim) {
          const Point& p = surface.vertices[static_cast<size_t>(v)];
          points.emplace_back(p[0], p[1], p[2]);
        }
        std::vector<CGAL::Triple<int, int, int>> patch;
        pmp::triangulate_hole_polyline(points, std::back_inserter(patch));
        std::vector<int32_t> corners;
        for (const auto& [a, b, c] : patch) corners.insert(corners.end(), {a, b, c});
        std::string result;
        AppendValues<int32_t>(result, corners);
        return result;
      },
      kMostCpu);
  std::vector<Corners> wall;
  if (!bytes.ok()) return wall;
  const char* next = bytes->data();
  const auto corners = TakeValues<int32_t>(next);
  for (size_t i = 0; i + 2 < corners.size(); i += 3) {
    const auto at = [&](size_t k) { return rim[static_cast<size_t>(corners[i + k])]; };
    wall.push_back({at(0), at(1), at(2)});
  }
  // The order of the patch's corners is not promised.
  const auto goes_along = [&](const Corners& corner) {
    for (size_t i = 0; i < 3; ++i) {
      if (corner[i] == rim[0] && corner[(i + 1) % 3] == rim[1]) return true;
    }
    return false;
  };
  if (std::ranges::none_of(wall, goes_along)) {
    for (Corners& corner : wall) std::swap(corner[1], corner[2]);
  }
  return wall;
}

/// Puts a wall into each rim that two regions share.
void CloseSharedRims(const SurfaceMesh& surface, std::vector<std::vector<Corners>>& regions) {
  std::map<Rim, size_t> region_of_rim;
  for (size_t r = 0; r < regions.size(); ++r) {
    for (Rim& rim : RimsOf(regions[r])) region_of_rim.emplace(std::move(rim), r);
  }
  for (const auto& [rim, region] : region_of_rim) {
    const Rim reversed = Reversed(rim);
    const auto other = region_of_rim.find(reversed);
    if (other == region_of_rim.end() || other->second == region || reversed < rim) continue;
    // Along the rim the region's own triangles go, so that its wall goes against it.
    for (const auto& [a, b, c] : WallIn(rim, surface)) {
      regions[other->second].push_back({a, b, c});
      regions[region].push_back({a, c, b});
    }
  }
}

/// Divides a region into pieces, each with its cavities.
std::vector<SurfaceMesh> PiecesOf(const SurfaceMesh& region) {
  std::vector<Shell> shells = FindShells(region);
  const double sign = shells.empty() || shells.front().volume_m3 > 0 ? 1 : -1;
  std::vector<std::pair<const Shell*, std::vector<Corners>>> pieces;
  const auto add = [&](const Shell& shell, std::vector<Corners>& triangles) {
    for (const int32_t t : shell.triangles) {
      triangles.push_back(region.triangles[static_cast<size_t>(t)]);
      if (sign < 0) std::swap(triangles.back()[1], triangles.back()[2]);
    }
  };
  for (const Shell& shell : shells) {
    if (sign * shell.volume_m3 > 0) add(shell, pieces.emplace_back(&shell, 0).second);
  }
  for (const Shell& shell : shells) {
    if (sign * shell.volume_m3 > 0) continue;
    const Point inside = MiddleOf(CornersOf(region, static_cast<size_t>(shell.triangles.front())));
    for (auto& [outer, triangles] : pieces) {
      if (std::abs(WindingNumber(region, *outer, inside)) < 0.5 && outer != pieces.back().first) {
        continue;
      }
      add(shell, triangles);
      break;
    }
  }
  if (pieces.empty()) return {region};  // CheckSurface refuses it by name
  std::vector<SurfaceMesh> surfaces;
  surfaces.reserve(pieces.size());
  for (const auto& [outer, triangles] : pieces)
    surfaces.push_back(PartOf(region.vertices, triangles));
  return surfaces;
}

/// The boxes around two surfaces have a point in common.
bool BoxesTouch(const SurfaceMesh& first, const SurfaceMesh& second) {
  for (size_t x = 0; x < 3; ++x) {
    const auto [low1, high1] =
        std::ranges::minmax_element(first.vertices, {}, [&](const Point& p) { return p[x]; });
    const auto [low2, high2] =
        std::ranges::minmax_element(second.vertices, {}, [&](const Point& p) { return p[x]; });
    if ((*high1)[x] < (*low2)[x] || (*high2)[x] < (*low1)[x]) return false;
  }
  return true;
}

/// Gives parts that lie on each other the same triangles there. Returns nothing if the library
/// fails.
bool MakeConforming(std::vector<BodyPart>& parts) {
  const auto bytes = RunInChild(
      [&] {
        std::vector<HalfedgeMesh> meshes;
        meshes.reserve(parts.size());
        for (const BodyPart& part : parts) meshes.push_back(*ToHalfedges(part.surface));
        for (size_t i = 0; i < parts.size(); ++i) {
          for (size_t j = i + 1; j < parts.size(); ++j) {
            if (BoxesTouch(parts[i].surface, parts[j].surface)) pmp::corefine(meshes[i], meshes[j]);
          }
        }
        std::string result;
        for (const HalfedgeMesh& mesh : meshes) {
          const std::string one = ToBytes(mesh);
          AppendValues<char>(result, one);
        }
        return result;
      },
      kMostCpu);
  if (!bytes.ok()) return false;
  const char* next = bytes->data();
  for (BodyPart& part : parts) {
    const std::vector<char> one = TakeValues<char>(next);
    part.surface = SurfaceFromBytes(std::string(one.begin(), one.end()));
  }
  return true;
}

/// Finds the walls, where triangles of two parts lie on each other, and the outside, which has all
/// other triangles. Vertices at the same place are one.
JoinedParts Weld(std::vector<BodyPart> parts) {
  JoinedParts joined;
  std::map<Point, int32_t> number;
  std::map<Corners, Corners> unpaired;
  for (const BodyPart& part : parts) {
    for (Corners corner : part.surface.triangles) {
      for (int32_t& v : corner) {
        const Point& p = part.surface.vertices[static_cast<size_t>(v)];
        const auto [found, is_new] =
            number.try_emplace(p, static_cast<int32_t>(joined.outside.vertices.size()));
        if (is_new) joined.outside.vertices.push_back(p);
        v = found->second;
      }
      Corners sorted = corner;
      std::ranges::sort(sorted);
      const auto [found, is_new] = unpaired.try_emplace(sorted, corner);
      if (is_new) continue;
      joined.walls.push_back(found->second);
      unpaired.erase(found);
    }
  }
  for (const auto& [sorted, corner] : unpaired) joined.outside.triangles.push_back(corner);
  joined.parts = std::move(parts);
  return joined;
}

}  // namespace

absl::StatusOr<JoinedParts> JoinParts(const SurfaceMesh& surface,
                                      const std::vector<int32_t>& region_of_triangle,
                                      const std::vector<std::string>& names) {
  std::vector<std::vector<Corners>> regions(names.size());
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    if (IsCollapsed(surface.triangles[t])) continue;
    regions[static_cast<size_t>(region_of_triangle[t])].push_back(surface.triangles[t]);
  }
  CloseSharedRims(surface, regions);
  std::vector<BodyPart> parts;
  for (size_t r = 0; r < regions.size(); ++r) {
    const SurfaceMesh region = PartOf(surface.vertices, regions[r]);
    for (SurfaceMesh& piece : PiecesOf(region)) {
      const absl::Status sound = CheckSurface(piece).status();
      if (!sound.ok()) return Explained(sound, absl::StrCat("the region ", names[r]));
      parts.push_back({std::move(piece), static_cast<int32_t>(r)});
    }
  }
  JoinedParts joined = Weld(parts);
  absl::Status sound = CheckSurface(joined.outside).status();
  if (!sound.ok() && MakeConforming(parts)) {
    joined = Weld(std::move(parts));
    sound = CheckSurface(joined.outside).status();
  }
  if (sound.ok()) return joined;
  return Explained(sound, "the regions overlap, or leave gaps, where they are to touch");
}

void NameRegions(const std::vector<BodyPart>& parts, TetMesh& mesh) {
  mesh.regions.resize(mesh.element_count());  // without walls there is one space
  absl::flat_hash_map<int32_t, int32_t> region_of_space;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const auto [found, is_new] = region_of_space.try_emplace(mesh.regions[e], 0);
    if (!is_new) continue;
    Point middle{};
    for (size_t i = 0; i < 4; ++i) {
      const int32_t node = mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element) + i];
      for (size_t x = 0; x < 3; ++x) middle[x] += mesh.nodes[static_cast<size_t>(node)][x] / 4;
    }
    const auto contains = [&](const BodyPart& part) {
      Shell all{std::vector<int32_t>(part.surface.triangles.size()), 0};
      std::iota(all.triangles.begin(), all.triangles.end(), 0);
      return WindingNumber(part.surface, all, middle) > 0.5;
    };
    const auto part = std::ranges::find_if(parts, contains);
    if (part != parts.end()) found->second = part->region;
  }
  for (int32_t& region : mesh.regions) region = region_of_space.at(region);
}

}  // namespace carillon::precompute
