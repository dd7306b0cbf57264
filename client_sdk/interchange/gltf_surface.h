// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/interchange/gltf_document.h"

namespace carillon::interchange {

/// Vertices (three floats each) and triangles (three indices each, all of them in range).
struct GltfSurface {
  std::vector<float> vertices;
  std::vector<uint32_t> triangles;
};

/// The triangles of a mesh, one primitive after the other. Errors: InvalidArgument
/// (MODEL_FILE_MALFORMED, MODEL_FILE_INCOMPLETE: it has no triangles).
absl::StatusOr<GltfSurface> ReadMesh(GltfDocument& file, uint64_t mesh);

/// Whether there are triangles, three indices each, of so many vertices. Errors: InvalidArgument
/// (MODEL_FILE_MALFORMED).
absl::Status CheckTriangles(const std::vector<uint32_t>& triangles, size_t vertex_count);

/// For each of `places`, the index of the nearest of `points` (three finite floats each, at least
/// one of them).
std::vector<uint32_t> NearestPoints(const std::vector<float>& points,
                                    const std::vector<float>& places);

}  // namespace carillon::interchange
