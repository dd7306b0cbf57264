// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read_mesh.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read_gmsh.h"
#include "precompute/mesh/read_surface.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

constexpr std::array<const char*, 4> kSurfaceFormats = {"obj", "ply", "stl", "off"};

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad()) {
    return Refusal(absl::StatusCode::kNotFound, "MESH_FILE_NOT_READABLE",
                   absl::StrCat(path, " cannot be read: check its name and its permissions"));
  }
  if (bytes.empty()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_EMPTY",
                   "the mesh file has no bytes: export the body again");
  }
  return bytes;
}

void Scale(std::vector<Point>& points, double factor) {
  for (Point& p : points) {
    for (double& x : p) x *= factor;
  }
}

}  // namespace

absl::StatusOr<Mesh> ReadMesh(const std::string& path, const std::string& format,
                              double metres_per_unit) {
  const bool is_surface = std::ranges::find(kSurfaceFormats, format) != kSurfaceFormats.end();
  if (!is_surface && format != "msh") {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_FORMAT_UNKNOWN",
                   absl::StrCat("there is no mesh format \"", format,
                                "\": give obj, ply, stl or off (a surface) or msh (Gmsh MSH 2.2)"));
  }
  absl::StatusOr<std::string> bytes = ReadFile(path);
  if (!bytes.ok()) return bytes.status();
  if (is_surface) {
    absl::StatusOr<SurfaceMesh> surface = ReadSurface(*std::move(bytes), format);
    if (!surface.ok()) return surface.status();
    Scale(surface->vertices, metres_per_unit);
    return *std::move(surface);
  }
  absl::StatusOr<TetMesh> mesh = ReadGmsh(*bytes);
  if (!mesh.ok()) return mesh.status();
  Scale(mesh->nodes, metres_per_unit);
  return *std::move(mesh);
}

}  // namespace carillon::precompute
