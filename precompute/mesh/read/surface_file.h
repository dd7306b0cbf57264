// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The polygons of a surface file. Neither indices nor coordinates have been checked.
struct SurfaceFile {
  std::vector<Point> vertices;   ///< in the file's unit, where its scene places them
  std::vector<int32_t> corners;  ///< indices into `vertices`, polygon after polygon
  std::vector<size_t> ends;      ///< for each polygon, the index after its last corner
  /// Whether `vertices` are those of the file in its order, so that users can name them by number.
  bool has_numbers = true;
  std::vector<MeshGroup> groups = {};
  std::vector<std::string> warnings = {};
  std::vector<MeshRegion> regions = {{}};  ///< each once; the first has no name
  std::vector<int32_t> region_of_polygon = {};
  int32_t region = 0;  ///< that of the polygons to come

  /// Lets the polygons to come belong to a region.
  void EnterRegion(const MeshRegion& entered) {
    region = static_cast<int32_t>(std::ranges::find(regions, entered) - regions.begin());
    if (static_cast<size_t>(region) == regions.size()) regions.push_back(entered);
  }

  /// Adds a polygon, unless it has fewer than three corners and bounds nothing.
  void AddPolygon(std::span<const int32_t> polygon) {
    if (polygon.size() < 3) return;
    corners.insert(corners.end(), polygon.begin(), polygon.end());
    ends.push_back(corners.size());
    region_of_polygon.push_back(region);
  }

  /// Adds a triangle with three vertices of its own.
  void AddTriangle(const std::array<Point, 3>& triangle) {
    for (const Point& p : triangle) {
      corners.push_back(static_cast<int32_t>(vertices.size()));
      vertices.push_back(p);
    }
    ends.push_back(corners.size());
    region_of_polygon.push_back(region);
  }

  /// Returns the number of triangles into which the polygons are split.
  size_t triangle_count() const { return corners.size() - 2 * ends.size(); }
};

/// Each of these functions reads the bytes of one format.
///
/// Errors: MESH_UNREADABLE with the line, the byte or the name of what is not read,
/// MESH_INDEX_OUT_OF_RANGE, MESH_NOT_FINITE, MESH_TOO_LARGE.
absl::StatusOr<SurfaceFile> ParseObj(const std::string& bytes);
absl::StatusOr<SurfaceFile> ParseOff(const std::string& bytes);
absl::StatusOr<SurfaceFile> ParsePly(const std::string& bytes);
absl::StatusOr<SurfaceFile> ParseStl(const std::string& bytes);
/// Reads text and binary. All data of the document must be embedded in it.
absl::StatusOr<SurfaceFile> ParseGltf(const std::string& bytes);

}  // namespace carillon::precompute
