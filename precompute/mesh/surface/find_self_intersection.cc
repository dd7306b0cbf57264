// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/find_self_intersection.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <cstddef>
#include <iterator>
#include <vector>

#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using HalfedgeMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Face = HalfedgeMesh::Face_index;

constexpr unsigned kOneIsEnough = 1;

}  // namespace

std::optional<SurfaceDefect> FindSelfIntersection(const SurfaceMesh& surface) {
  HalfedgeMesh mesh;
  for (const Point& p : surface.vertices) mesh.add_vertex({p[0], p[1], p[2]});
  std::vector<int32_t> triangle_of_face;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    if (IsCollapsed(surface.triangles[t])) continue;
    const auto& [a, b, c] = surface.triangles[t];
    using Vertex = HalfedgeMesh::Vertex_index;
    const Face face =
        mesh.add_face(Vertex(static_cast<unsigned>(a)), Vertex(static_cast<unsigned>(b)),
                      Vertex(static_cast<unsigned>(c)));
    const auto triangle = static_cast<int32_t>(t);
    if (face == HalfedgeMesh::null_face()) {
      return SurfaceDefect{SurfaceDefect::Kind::kPinched, triangle, triangle};
    }
    triangle_of_face.push_back(triangle);
  }
  std::vector<std::pair<Face, Face>> found;
  CGAL::Polygon_mesh_processing::self_intersections(mesh, std::back_inserter(found),
                                                    CGAL::parameters::maximum_number(kOneIsEnough));
  if (found.empty()) return std::nullopt;
  const auto triangle = [&](Face face) { return triangle_of_face[static_cast<size_t>(face)]; };
  const auto [first, second] = found.front();
  return SurfaceDefect{
      first == second ? SurfaceDefect::Kind::kFlatTriangle : SurfaceDefect::Kind::kSelfIntersecting,
      triangle(first), triangle(second)};
}

}  // namespace carillon::precompute
