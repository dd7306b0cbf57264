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
#include "precompute/mesh/gmsh_file.h"
#include "precompute/mesh/make_tet_mesh.h"
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

void Scale(Point& p, double factor) {
  for (double& x : p) x *= factor;
}

void Scale(NamedMesh& named, double factor) {
  auto* surface = std::get_if<SurfaceMesh>(&named.mesh);
  auto& points = surface != nullptr ? surface->vertices : std::get<TetMesh>(named.mesh).nodes;
  for (Point& p : points) Scale(p, factor);
  for (auto& [number, p] : named.names.vertices) Scale(p, factor);
}

absl::StatusOr<NamedMesh> ReadTets(const std::string& bytes) {
  absl::StatusOr<TetFile> file = ParseGmsh(bytes);
  if (!file.ok()) return file.status();
  return MakeTetMesh(*std::move(file));
}

}  // namespace

absl::StatusOr<NamedMesh> ReadMesh(const std::string& path, const std::string& format,
                                   double metres_per_unit) {
  const bool is_surface = std::ranges::find(kSurfaceFormats, format) != kSurfaceFormats.end();
  if (!is_surface && format != "msh") {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_FORMAT_UNKNOWN",
                   absl::StrCat("there is no mesh format \"", format,
                                "\": give obj, ply, stl or off (a surface) or msh (Gmsh MSH 2.2)"));
  }
  const absl::StatusOr<std::string> bytes = ReadFile(path);
  if (!bytes.ok()) return bytes.status();
  absl::StatusOr<NamedMesh> named = is_surface ? ReadSurface(*bytes, format) : ReadTets(*bytes);
  if (!named.ok()) return named.status();
  Scale(*named, metres_per_unit);
  return named;
}

}  // namespace carillon::precompute
