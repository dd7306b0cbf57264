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
#include <cmath>
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
/// A hole in a flat face has at most this many edges.
constexpr int kMostFlatEdges = 8;
/// Distance from a plane within which a hole lies in a flat face, as a part of the diagonal.
constexpr double kFlatFacePart = 1e-5;
/// Rings of triangles about overlapping ones that are replaced, too, where fewer do not suffice.
constexpr int kMostRings = 3;
constexpr std::chrono::seconds kMostRepairCpu(60);

Point At(const HalfedgeMesh& mesh, HalfedgeMesh::Vertex_index vertex) {
  const auto& p = mesh.point(vertex);
  return {p.x(), p.y(), p.z()};
}

/// The plane of a closed polygon by Newell's method; the normal has twice the polygon's area.
struct Rim {
  Point middle{0, 0, 0};
  Point normal{0, 0, 0};
  int edge_count = 0;

  double DistanceOf(const Point& p) const {
    return std::abs(Dot(Difference(p, middle), normal)) / Norm(normal);
  }
};

Rim MeasureRim(const HalfedgeMesh& mesh, Halfedge rim) {
  Rim result;
  const Point origin = At(mesh, mesh.target(rim));
  for (const Halfedge h : CGAL::halfedges_around_face(rim, mesh)) {
    const Point a = Difference(At(mesh, mesh.source(h)), origin);
    const Point b = Difference(At(mesh, mesh.target(h)), origin);
    const Point turn = Cross(a, b);
    for (size_t i = 0; i < 3; ++i) {
      result.normal[i] += turn[i];
      result.middle[i] += a[i];
    }
    ++result.edge_count;
  }
  for (size_t i = 0; i < 3; ++i)
    result.middle[i] = origin[i] + result.middle[i] / result.edge_count;
  return result;
}

/// Whether the hole is a part of a flat face, see CloseFlatFaces.
bool IsInFlatFace(const HalfedgeMesh& mesh, Halfedge rim, double flat_m) {
  const Rim plane = MeasureRim(mesh, rim);
  if (plane.edge_count > kMostFlatEdges || !(Norm(plane.normal) > 0)) return false;
  bool continues = false;
  for (const Halfedge h : CGAL::halfedges_around_face(rim, mesh)) {
    if (plane.DistanceOf(At(mesh, mesh.target(h))) > flat_m) return false;
    const Point from = At(mesh, mesh.source(h));
    const Point beside = At(mesh, mesh.target(mesh.next(mesh.opposite(h))));
    if (plane.DistanceOf(beside) > flat_m) continue;
    // The rim of a flat sheet surrounds the triangles beside it; a hole does not.
    const Point inward = Cross(plane.normal, Difference(At(mesh, mesh.target(h)), from));
    if (Dot(inward, Difference(beside, from)) > 0) return false;
    continues = true;
  }
  return continues;
}

bool CloseInPlane(HalfedgeMesh& mesh, Halfedge rim, double flat_m) {
  std::vector<HalfedgeMesh::Face_index> faces;
  pmp::triangulate_hole(
      mesh, rim, std::back_inserter(faces),
      CGAL::parameters::use_2d_constrained_delaunay_triangulation(true).threshold_distance(flat_m));
  return !faces.empty();
}

/// Limits of the holes that FillAll fills.
struct HoleLimits {
  double longest_rim_m;  ///< of holes that are not in flat faces
  double flat_m;         ///< distance from a plane within which points count as lying in it
};

/// Fills every hole. Returns nothing where a rim is too long, or a hole cannot be filled.
std::string FillAll(HalfedgeMesh mesh, const HoleLimits& limits) {
  const double area = pmp::area(mesh);
  double patch_area = 0;
  std::vector<Halfedge> rims;
  pmp::extract_boundary_cycles(mesh, std::back_inserter(rims));
  for (const Halfedge rim : rims) {
    if (IsInFlatFace(mesh, rim, limits.flat_m)) {
      if (!CloseInPlane(mesh, rim, limits.flat_m)) return "";
      continue;
    }
    if (pmp::face_border_length(rim, mesh) > limits.longest_rim_m) return "";
    std::vector<HalfedgeMesh::Face_index> faces;
    std::vector<HalfedgeMesh::Vertex_index> vertices;
    pmp::triangulate_refine_and_fair_hole(mesh, rim, std::back_inserter(faces),
                                          std::back_inserter(vertices));
    if (faces.empty()) return "";
    patch_area += pmp::area(faces, mesh);
  }
  if (patch_area > area * kPatchPart) return "";
  return ToBytes(std::move(mesh));
}

/// Fills every hole that the removal of triangles has left, within the plane of its rim where that
/// is flat within `flat_m`, and without new vertices.
std::string CloseAll(HalfedgeMesh mesh, double flat_m) {
  std::vector<Halfedge> rims;
  pmp::extract_boundary_cycles(mesh, std::back_inserter(rims));
  for (const Halfedge rim : rims) {
    if (!CloseInPlane(mesh, rim, flat_m)) return "";
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

std::optional<RepairedSurface> CloseFlatFaces(const SurfaceMesh& surface) {
  const HoleLimits limits{.longest_rim_m = 0, .flat_m = kFlatFacePart * Diagonal(surface.vertices)};
  std::optional<SurfaceMesh> closed =
      InChild(surface, [&](HalfedgeMesh mesh) { return FillAll(std::move(mesh), limits); });
  if (!closed) return std::nullopt;
  return RepairedSurface{*std::move(closed),
                         {"repaired: holes in flat faces closed in the plane of the face"}};
}

std::optional<RepairedSurface> FillHoles(const SurfaceMesh& surface) {
  if (auto closed = CloseFlatFaces(surface)) return closed;
  const double diagonal = Diagonal(surface.vertices);
  const HoleLimits limits{.longest_rim_m = kPatchRim * diagonal,
                          .flat_m = kFlatFacePart * diagonal};
  std::optional<SurfaceMesh> filled =
      InChild(surface, [&](HalfedgeMesh mesh) { return FillAll(std::move(mesh), limits); });
  if (!filled) return std::nullopt;
  const double distance = GreatestDistance(*filled, NearestTriangle(surface));
  return RepairedSurface{
      *std::move(filled),
      {absl::StrFormat("repaired: holes filled with smooth patches; the widest reaches %.3g m from "
                       "the given surface, which is about half its width, and the true shape there "
                       "is unknown; if the body is open there, give it a wall instead (--wall)",
                       distance)}};
}

double WidestHole(const SurfaceMesh& surface) {
  if (FindShells(surface).size() != 1) return 0;
  const std::optional<HalfedgeMesh> mesh = ToHalfedges(surface);
  if (!mesh) return 0;
  std::vector<Halfedge> rims;
  pmp::extract_boundary_cycles(*mesh, std::back_inserter(rims));
  double widest = 0;
  for (const Halfedge rim : rims) {
    const double area = Norm(MeasureRim(*mesh, rim).normal) / 2;
    widest = std::max(widest, 4 * area / pmp::face_border_length(rim, *mesh));
  }
  return widest;
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
