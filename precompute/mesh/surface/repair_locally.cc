// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/repair_locally.h"

#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/repair.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/run_in_child.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/find_overlaps.h"
#include "precompute/mesh/surface/halfedge_mesh.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Halfedge = HalfedgeMesh::Halfedge_index;

/// Longest rim of a hole that is filled, as a part of the diagonal.
constexpr double kPatchRim = 1;
/// Largest area of all patches, as a part of the surface's.
constexpr double kPatchPart = 1.0 / 20;
/// Largest distance of an untangled surface from the given one, as a part of the diagonal.
constexpr double kUntangledPart = 1e-3;
/// Greatest distance of a hole's rim from a plane in which the hole is filled, as a part of the
/// diagonal.
constexpr double kFlatPart = 1e-6;
/// Rings of triangles about overlapping ones that are replaced, too, where fewer do not suffice.
constexpr int kMostRings = 3;
constexpr std::chrono::seconds kMostRepairCpu(60);

/// Returns nothing for a surface that is no manifold.
std::optional<HalfedgeMesh> ToHalfedges(const SurfaceMesh& surface) {
  HalfedgeMesh mesh;
  for (const Point& p : surface.vertices) mesh.add_vertex({p[0], p[1], p[2]});
  for (const auto& triangle : surface.triangles) {
    if (IsCollapsed(triangle)) continue;
    std::array<HalfedgeMesh::Vertex_index, 3> corners;
    for (size_t i = 0; i < 3; ++i) {
      corners[i] = HalfedgeMesh::Vertex_index(static_cast<unsigned>(triangle[i]));
    }
    if (mesh.add_face(corners) == HalfedgeMesh::null_face()) return std::nullopt;
  }
  return mesh;
}

/// Fills every hole. Returns nothing where a rim is too long, or a hole cannot be filled.
std::string FillAll(HalfedgeMesh mesh, double longest_rim) {
  const double area = pmp::area(mesh);
  std::vector<Halfedge> rims;
  pmp::extract_boundary_cycles(mesh, std::back_inserter(rims));
  for (const Halfedge rim : rims) {
    if (pmp::face_border_length(rim, mesh) > longest_rim) return "";
    std::vector<HalfedgeMesh::Face_index> faces;
    std::vector<HalfedgeMesh::Vertex_index> vertices;
    pmp::triangulate_refine_and_fair_hole(mesh, rim, std::back_inserter(faces),
                                          std::back_inserter(vertices));
    if (faces.empty()) return "";
  }
  if (pmp::area(mesh) > area * (1 + kPatchPart)) return "";
  return ToBytes(std::move(mesh));
}

/// Fills every hole that the removal of triangles has left, within the plane of its rim where that
/// is flat within `flat_m`, and without new vertices.
std::string CloseAll(HalfedgeMesh mesh, double flat_m) {
  std::vector<Halfedge> rims;
  pmp::extract_boundary_cycles(mesh, std::back_inserter(rims));
  for (const Halfedge rim : rims) {
    std::vector<HalfedgeMesh::Face_index> faces;
    pmp::triangulate_hole(
        mesh, rim, std::back_inserter(faces),
        CGAL::parameters::use_2d_constrained_delaunay_triangulation(true).threshold_distance(
            flat_m));
    if (faces.empty()) return "";
  }
  pmp::remove_isolated_vertices(mesh);
  return ToBytes(std::move(mesh));
}

std::string UntangleAll(HalfedgeMesh mesh) {
  return pmp::experimental::remove_self_intersections(mesh) ? ToBytes(std::move(mesh)) : "";
}

/// The result of `work` on the surface. It runs in a child, because CGAL's assertions end the
/// process.
std::optional<SurfaceMesh> InChild(const SurfaceMesh& surface,
                                   const std::function<std::string(HalfedgeMesh)>& work) {
  const absl::StatusOr<std::string> bytes = RunInChild(
      [&] {
        std::optional<HalfedgeMesh> mesh = ToHalfedges(surface);
        return mesh ? work(*std::move(mesh)) : "";
      },
      kMostRepairCpu);
  if (!bytes.ok() || bytes->empty()) return std::nullopt;
  return SurfaceFromBytes(*bytes);
}

/// The triangles that overlap others, and those that share a vertex with such a triangle, `rings`
/// times over.
std::vector<bool> AtOverlaps(const SurfaceMesh& surface,
                             const std::vector<std::pair<int32_t, int32_t>>& overlaps, int rings) {
  std::vector<bool> at(surface.triangles.size(), false);
  for (const auto& [first, second] : overlaps) {
    at[static_cast<size_t>(first)] = at[static_cast<size_t>(second)] = true;
  }
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<bool> reached(surface.vertices.size(), false);
    for (size_t t = 0; t < at.size(); ++t) {
      if (!at[t]) continue;
      for (const int32_t v : surface.triangles[t]) reached[static_cast<size_t>(v)] = true;
    }
    for (size_t t = 0; t < at.size(); ++t) {
      at[t] = at[t] || std::ranges::any_of(surface.triangles[t], [&](int32_t v) {
                return reached[static_cast<size_t>(v)];
              });
    }
  }
  return at;
}

/// The surface without the triangles that are `gone`, and without the smaller pieces into which
/// their removal has cut a shell.
SurfaceMesh Without(const SurfaceMesh& surface, const std::vector<bool>& gone) {
  std::vector<size_t> shell_of(surface.triangles.size(), 0);
  const std::vector<Shell> shells = FindShells(surface);
  for (size_t s = 0; s < shells.size(); ++s) {
    for (const int32_t t : shells[s].triangles) shell_of[static_cast<size_t>(t)] = s;
  }
  SurfaceMesh rest{surface.vertices, {}};
  std::vector<size_t> given;
  for (size_t t = 0; t < gone.size(); ++t) {
    if (gone[t]) continue;
    rest.triangles.push_back(surface.triangles[t]);
    given.push_back(t);
  }
  std::vector<Shell> largest(shells.size());
  for (Shell& piece : FindShells(rest)) {
    Shell& kept = largest[shell_of[given[static_cast<size_t>(piece.triangles.front())]]];
    if (piece.triangles.size() > kept.triangles.size()) kept = std::move(piece);
  }
  SurfaceMesh whole{surface.vertices, {}};
  for (const Shell& piece : largest) {
    for (const int32_t t : piece.triangles) {
      whole.triangles.push_back(rest.triangles[static_cast<size_t>(t)]);
    }
  }
  return whole;
}

/// The surface as `repaired`, described as `what`, unless one is too far from the other.
std::optional<RepairedSurface> IfNear(const SurfaceMesh& surface, SurfaceMesh repaired,
                                      const char* what) {
  const double out = GreatestDistance(repaired, NearestTriangle(surface));
  const double in = GreatestDistance(surface, NearestTriangle(repaired));
  if (std::max(out, in) > kUntangledPart * Diagonal(surface.vertices)) return std::nullopt;
  return RepairedSurface{
      std::move(repaired),
      {absl::StrFormat("repaired: the triangles where the surface %s were replaced; the result is "
                       "at most %.3g m from the given surface, of which no part is further than "
                       "%.3g m from it",
                       what, out, in)}};
}

}  // namespace

std::optional<RepairedSurface> FillHoles(const SurfaceMesh& surface) {
  const double longest_rim = kPatchRim * Diagonal(surface.vertices);
  std::optional<SurfaceMesh> filled =
      InChild(surface, [=](HalfedgeMesh mesh) { return FillAll(std::move(mesh), longest_rim); });
  if (!filled) return std::nullopt;
  const double distance = GreatestDistance(*filled, NearestTriangle(surface));
  return RepairedSurface{
      *std::move(filled),
      {absl::StrFormat("repaired: holes filled with smooth patches, at most %.3g m from the given "
                       "surface; if the body is open there, give it a wall instead (--wall)",
                       distance)}};
}

std::optional<RepairedSurface> Unfold(const SurfaceMesh& surface) {
  const auto overlaps = FindOverlaps(surface, surface.triangles.size());
  if (overlaps.empty()) return std::nullopt;
  const double flat_m = kFlatPart * Diagonal(surface.vertices);
  for (int rings = 0; rings <= kMostRings; ++rings) {
    const SurfaceMesh cut = Without(surface, AtOverlaps(surface, overlaps, rings));
    if (cut.triangles.empty()) return std::nullopt;
    std::optional<SurfaceMesh> closed =
        InChild(cut, [=](HalfedgeMesh mesh) { return CloseAll(std::move(mesh), flat_m); });
    if (!closed || !CheckSurface(*closed).ok()) continue;
    auto unfolded = IfNear(surface, *std::move(closed), "lay folded on itself");
    if (unfolded) return unfolded;
  }
  return std::nullopt;
}

std::optional<RepairedSurface> Untangle(const SurfaceMesh& surface) {
  std::optional<SurfaceMesh> untangled = InChild(surface, UntangleAll);
  if (!untangled || untangled->triangles.empty()) return std::nullopt;
  return IfNear(surface, *std::move(untangled), "crossed itself");
}

}  // namespace carillon::precompute
