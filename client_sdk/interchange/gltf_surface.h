// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "proto/cpp/gltf/gltf_document.h"

namespace carillon::interchange {

/// A surface: three floats for each vertex, and three indices, all in range, for each triangle.
struct MeshSurface {
  std::vector<float> vertices;
  std::vector<uint32_t> triangles;
};

/// Reads the triangles of all primitives of a mesh, one primitive after the other. Throws a
/// GltfFault if the mesh is damaged. Errors: InvalidArgument (MODEL_FILE_MALFORMED: the mesh has
/// no triangles).
absl::StatusOr<MeshSurface> ReadMesh(const GltfDocument& file, uint64_t mesh);

/// Returns for each of `places` the index of the nearest of `points`. A point and a place are three
/// finite floats each, and there is at least one point.
std::vector<uint32_t> NearestPoints(const std::vector<float>& points,
                                    const std::vector<float>& places);

}  // namespace carillon::interchange
