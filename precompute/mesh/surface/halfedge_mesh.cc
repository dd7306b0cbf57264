// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/halfedge_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/mesh/byte_stream.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {

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

std::string ToBytes(HalfedgeMesh mesh) {
  mesh.collect_garbage();
  std::vector<double> coordinates;
  for (const auto vertex : mesh.vertices()) {
    const auto& p = mesh.point(vertex);
    coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});
  }
  std::vector<int32_t> corners;
  for (const auto face : mesh.faces()) {
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face))) {
      corners.push_back(static_cast<int32_t>(vertex));
    }
  }
  std::string bytes;
  AppendValues<double>(bytes, coordinates);
  AppendValues<int32_t>(bytes, corners);
  return bytes;
}

SurfaceMesh SurfaceFromBytes(const std::string& bytes) {
  const char* next = bytes.data();
  const auto coordinates = TakeValues<double>(next);
  const auto corners = TakeValues<int32_t>(next);
  SurfaceMesh surface;
  for (size_t i = 0; i + 2 < coordinates.size(); i += 3) {
    surface.vertices.push_back({coordinates[i], coordinates[i + 1], coordinates[i + 2]});
  }
  for (size_t i = 0; i + 2 < corners.size(); i += 3) {
    surface.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  }
  return surface;
}

}  // namespace carillon::precompute
