// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/read_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/read/far_origin.h"
#include "precompute/mesh/read/merge_vertices.h"
#include "precompute/mesh/read/surface_file.h"
#include "precompute/mesh/read/triangulate.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

absl::StatusOr<SurfaceFile> ParseSurface(const std::string& bytes, const std::string& format) {
  if (format == "obj") return ParseObj(bytes);
  if (format == "off") return ParseOff(bytes);
  if (format == "ply") return ParsePly(bytes);
  if (format == "stl") return ParseStl(bytes);
  if (format == "glb" || format == "gltf") return ParseGltf(bytes);
  return absl::InternalError(absl::StrCat("no reader of surfaces for the format ", format));
}

absl::Status CheckIndicesOf(const SurfaceFile& file) {
  const auto count = static_cast<int32_t>(file.vertices.size());
  size_t face = 0;
  for (size_t c = 0; c < file.corners.size(); ++c) {
    if (c == file.ends[face]) ++face;
    if (file.corners[c] >= 0 && file.corners[c] < count) continue;
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
                   absl::StrCat("face ", face, " names vertex ", file.corners[c], " of ", count,
                                " (counted from zero): export the mesh again"));
  }
  return absl::OkStatus();
}

/// Single precision has a greatest number, too.
absl::Status CheckFiniteVertices(const SurfaceFile& file) {
  for (size_t v = 0; v < file.vertices.size(); ++v) {
    const Point& p = file.vertices[v];
    bool finite = true;
    for (const double x : p) finite = finite && std::isfinite(static_cast<float>(x));
    if (finite) continue;
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_NOT_FINITE",
                   absl::StrCat("vertex ", v, " (counted from zero) lies at (", p[0], ", ", p[1],
                                ", ", p[2], "): give it finite coordinates"));
  }
  return absl::OkStatus();
}

/// Counts the vertices from the returned place, and rounds them to single precision. The rounded
/// numbers go through memory, because GCC 12 leaves the rounding out of some points where a double
/// becomes a float and a double again.
Point RoundVertices(std::vector<Point>& vertices) {
  const Point origin = FarOrigin(vertices);
  std::vector<std::array<float, 3>> rounded(vertices.size());
  for (size_t v = 0; v < vertices.size(); ++v) {
    for (size_t x = 0; x < 3; ++x) rounded[v][x] = static_cast<float>(vertices[v][x] - origin[x]);
  }
  for (size_t v = 0; v < vertices.size(); ++v) std::ranges::copy(rounded[v], vertices[v].begin());
  return origin;
}

/// The corners of all triangles, in the order of the polygons, and the region of each.
std::vector<std::array<Point, 3>> TrianglesOf(const SurfaceFile& file,
                                              std::vector<int32_t>& regions) {
  std::vector<std::array<int32_t, 3>> triangles;
  triangles.reserve(file.triangle_count());
  size_t begin = 0;
  for (size_t polygon = 0; polygon < file.ends.size(); ++polygon) {
    const size_t end = file.ends[polygon];
    Triangulate(std::span(file.corners).subspan(begin, end - begin), file.vertices, triangles);
    regions.resize(triangles.size(), file.region_of_polygon[polygon]);
    begin = end;
  }
  std::vector<std::array<Point, 3>> corners(triangles.size());
  for (size_t t = 0; t < triangles.size(); ++t) {
    for (size_t i = 0; i < 3; ++i) {
      corners[t][i] = file.vertices[static_cast<size_t>(triangles[t][i])];
    }
  }
  return corners;
}

/// Leaves out the regions that no triangle has.
void NameRegions(const std::vector<MeshRegion>& regions, MeshNames& names) {
  std::vector<int32_t> number(regions.size(), -1);
  for (int32_t& region : names.triangle_regions) {
    int32_t& known = number[static_cast<size_t>(region)];
    if (known < 0) {
      known = static_cast<int32_t>(names.regions.size());
      names.regions.push_back(regions[static_cast<size_t>(region)]);
    }
    region = known;
  }
  if (names.regions == std::vector<MeshRegion>(1)) names.regions.clear();
}

}  // namespace

absl::StatusOr<NamedMesh> ReadSurface(const std::string& bytes, const std::string& format) {
  ASSIGN_OR_RETURN(SurfaceFile file, ParseSurface(bytes, format));
  RETURN_IF_ERROR(CheckIndicesOf(file));
  RETURN_IF_ERROR(CheckFiniteVertices(file));
  if (file.ends.empty()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_EMPTY",
                   "the file has no faces: export the body as triangles or polygons");
  }
  const Point origin = RoundVertices(file.vertices);
  std::vector<int32_t> regions;
  NamedMesh named{MergeVertices(TrianglesOf(file, regions))};
  named.names.triangle_regions = std::move(regions);
  NameRegions(file.regions, named.names);
  if (file.has_numbers) {
    for (const Point& p : file.vertices) {
      const auto number = static_cast<int64_t>(named.names.vertices.size());
      named.names.vertices[number] = p;
    }
  }
  named.names.origin_m = origin;
  named.names.groups = std::move(file.groups);
  named.warnings = std::move(file.warnings);
  return named;
}

}  // namespace carillon::precompute
