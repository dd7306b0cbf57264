// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/remesh_surface.h"

#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/boost/graph/Euler_operations.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "precompute/mesh/run_in_child.h"
#include "precompute/mesh/surface/halfedge_mesh.h"

namespace carillon::precompute {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

constexpr std::chrono::seconds kMostCpu(300);
constexpr unsigned kIterations = 3;
/// A triangle of less than this part of edge^2 is a sliver.
constexpr double kSliverArea = 0.03;
constexpr int kSliverPasses = 4;

HalfedgeMesh ToCgal(const SurfaceMesh& given) {
  std::vector<HalfedgeKernel::Point_3> points;
  points.reserve(given.vertices.size());
  for (const Point& p : given.vertices) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<size_t, 3>> triangles;
  triangles.reserve(given.triangles.size());
  for (const auto& [a, b, c] : given.triangles) {
    triangles.push_back({static_cast<size_t>(a), static_cast<size_t>(b), static_cast<size_t>(c)});
  }
  // Where surfaces touch in a vertex or an edge these are doubled.
  pmp::orient_polygon_soup(points, triangles);
  HalfedgeMesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  return mesh;
}

double Area(const HalfedgeMesh& mesh, HalfedgeMesh::Face_index face) {
  const auto a = mesh.halfedge(face), b = mesh.next(a), c = mesh.next(b);
  return std::sqrt(CGAL::squared_area(mesh.point(mesh.target(a)), mesh.point(mesh.target(b)),
                                      mesh.point(mesh.target(c))));
}

HalfedgeMesh::Halfedge_index ShortestEdge(const HalfedgeMesh& mesh, HalfedgeMesh::Face_index face) {
  const auto squared_length = [&](HalfedgeMesh::Halfedge_index h) {
    return CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h)));
  };
  const auto shorter = [&](auto a, auto b) { return squared_length(a) < squared_length(b); };
  const auto first = mesh.halfedge(face);
  return std::min({first, mesh.next(first), mesh.prev(first)}, shorter);
}

bool CollapseSlivers(HalfedgeMesh& mesh, double edge_m) {
  bool any = false;
  const std::vector<HalfedgeMesh::Face_index> faces(mesh.faces().begin(), mesh.faces().end());
  for (const auto face : faces) {
    if (mesh.is_removed(face) || Area(mesh, face) > kSliverArea * edge_m * edge_m) continue;
    const auto edge = mesh.edge(ShortestEdge(mesh, face));
    if (!CGAL::Euler::does_satisfy_link_condition(edge, mesh)) continue;
    CGAL::Euler::collapse_edge(edge, mesh);
    any = true;
  }
  return any;
}

/// Runs in a child: CGAL's assertions end the process.
std::string Remesh(const SurfaceMesh& given, double edge_m, double sharp_degrees) {
  HalfedgeMesh mesh = ToCgal(given);
  // Triangles that cut off the edges of the body, such as the rim of a bell, would make it smaller
  // by a part of an edge.
  auto sharp = mesh.add_property_map<HalfedgeMesh::Edge_index, bool>("e:sharp", false).first;
  pmp::detect_sharp_edges(mesh, sharp_degrees, sharp);
  pmp::isotropic_remeshing(
      faces(mesh), edge_m, mesh,
      CGAL::parameters::number_of_iterations(kIterations).edge_is_constrained_map(sharp));
  for (int pass = 0; pass < kSliverPasses && CollapseSlivers(mesh, edge_m); ++pass) {
  }
  return ToBytes(std::move(mesh));
}

}  // namespace

absl::StatusOr<SurfaceMesh> RemeshSurface(const SurfaceMesh& given, double edge_m,
                                          double sharp_degrees) {
  const absl::StatusOr<std::string> bytes =
      RunInChild([&] { return Remesh(given, edge_m, sharp_degrees); }, kMostCpu);
  if (!bytes.ok()) return bytes.status();
  return SurfaceFromBytes(*bytes);
}

}  // namespace carillon::precompute
