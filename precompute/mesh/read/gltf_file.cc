// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "precompute/mesh/mesh_limits.h"
#include "precompute/mesh/read/surface_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf/gltf_document.h"
#include "proto/cpp/gltf/gltf_nodes.h"
#include "proto/cpp/gltf/gltf_surface.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Json = nlohmann::json;

/// The surfaces of a file, as far as they were read.
struct GltfScene {
  SurfaceFile file;
  bool has_lines = false;
};

/// Adds the triangles of the primitives of a node or mesh, each with vertices of its own. A
/// primitive with another name or material begins another region.
absl::Status Add(const std::vector<GltfSurface>& primitives, const Json& named, GltfScene& scene) {
  for (const GltfSurface& surface : primitives) {
    scene.file.EnterRegion({named.value("name", ""), surface.material});
    const size_t triangle_count = surface.corners.size() / 3;
    scene.has_lines = scene.has_lines || triangle_count == 0;
    if (scene.file.ends.size() + triangle_count > static_cast<size_t>(kMaxSurfaceTriangles)) {
      return Refusal(
          absl::StatusCode::kInvalidArgument, "MESH_TOO_LARGE",
          absl::StrCat("the file cannot be read as glTF: its scene has more than ",
                       kMaxSurfaceTriangles, " triangles: simplify it, or leave out parts"));
    }
    for (size_t t = 0; t < triangle_count; ++t) {
      const uint32_t* const corners = &surface.corners[3 * t];
      scene.file.AddTriangle(
          {surface.points[corners[0]], surface.points[corners[1]], surface.points[corners[2]]});
    }
  }
  return absl::OkStatus();
}

/// Reads the primitives that the scene shows, where it places them.
absl::Status ReadNodes(const GltfDocument& document, const GltfNodes& nodes, GltfScene& scene) {
  const std::vector<GltfMatrix> worlds = nodes.Worlds(nodes.locals());
  for (const size_t n : nodes.Shown(document)) {
    const Json& node = document.At("nodes", n);
    const Json extensions = node.value("extensions", Json::object());
    if (!extensions.value("KHR_node_visibility", Json::object()).value("visible", true)) {
      throw GltfFault(
          "it hides a node (KHR_node_visibility): leave out what does not belong to the body");
    }
    if (!node.contains("mesh")) continue;
    RETURN_IF_ERROR(Add(ReadPlacedMesh(document, n, worlds), node, scene));
  }
  return absl::OkStatus();
}

absl::Status ReadMeshes(const GltfDocument& document, GltfScene& scene) {
  for (const Json& mesh : document.root().value("meshes", Json::array())) {
    for (const Json& primitive : mesh.at("primitives")) {
      RETURN_IF_ERROR(Add(
          {ReadPrimitive(document, primitive, mesh.value("weights", Json::array()))}, mesh, scene));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<SurfaceFile> ParseScene(std::string_view bytes) {
  const GltfDocument document(bytes);
  document.CheckExtensions();
  GltfScene scene;
  scene.file.has_numbers = false;
  const size_t scene_count = document.root().value("scenes", Json::array()).size();
  if (scene_count > 1) {
    scene.file.warnings.push_back(absl::StrCat(
        "the file has ", scene_count, " scenes, of which only the one that it shows was read"));
  }
  const GltfNodes nodes(document);
  RETURN_IF_ERROR(nodes.count() > 0 ? ReadNodes(document, nodes, scene)
                                    : ReadMeshes(document, scene));
  if (scene.has_lines) {
    scene.file.warnings.emplace_back("points and lines of the file were left out");
  }
  return std::move(scene.file);
}

}  // namespace

absl::StatusOr<SurfaceFile> ParseGltf(const std::string& bytes) {
  try {
    return ParseScene(bytes);
  } catch (const GltfFault& fault) {
    return GltfRefusal("MESH_UNREADABLE", fault);
  } catch (const Json::exception& fault) {
    return GltfRefusal("MESH_UNREADABLE", fault);
  }
}

}  // namespace carillon::precompute
