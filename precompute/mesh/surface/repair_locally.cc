// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/repair_locally.h"

#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
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

std::optional<RepairedSurface> Untangle(const SurfaceMesh& surface) {
  std::optional<SurfaceMesh> untangled = InChild(surface, UntangleAll);
  if (!untangled || untangled->triangles.empty()) return std::nullopt;
  const double out = GreatestDistance(*untangled, NearestTriangle(surface));
  const double in = GreatestDistance(surface, NearestTriangle(*untangled));
  if (std::max(out, in) > kUntangledPart * Diagonal(surface.vertices)) return std::nullopt;
  return RepairedSurface{
      *std::move(untangled),
      {absl::StrFormat("repaired: the triangles where the surface crossed itself were replaced; "
                       "the result is at most %.3g m from the given surface, of which no part is "
                       "further than %.3g m from it",
                       out, in)}};
}

}  // namespace carillon::precompute
