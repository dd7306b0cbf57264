// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/interchange/gltf_document.h"

namespace carillon::interchange {

/// A surface: three floats for each vertex, and three indices, all in range, for each triangle.
struct GltfSurface {
  std::vector<float> vertices;
  std::vector<uint32_t> triangles;
};

/// Reads the triangles of all primitives of a mesh, one primitive after the other. Errors:
/// InvalidArgument (MODEL_FILE_MALFORMED; MODEL_FILE_INCOMPLETE: the mesh has no triangles).
absl::StatusOr<GltfSurface> ReadMesh(GltfDocument& file, uint64_t mesh);

/// Checks that there are triangles, and that each has three indices below `vertex_count`. Errors:
/// InvalidArgument (MODEL_FILE_MALFORMED).
absl::Status CheckTriangles(const std::vector<uint32_t>& triangles, size_t vertex_count);

/// Returns for each of `places` the index of the nearest of `points`. A point and a place are three
/// finite floats each, and there is at least one point.
std::vector<uint32_t> NearestPoints(const std::vector<float>& points,
                                    const std::vector<float>& places);

}  // namespace carillon::interchange
