// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/halfedge_mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/mesh/byte_stream.h"

namespace carillon::precompute {

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
