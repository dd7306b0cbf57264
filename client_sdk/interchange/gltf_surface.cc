// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_surface.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"
#include "client_sdk/interchange/gltf_accessor.h"
#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

constexpr uint64_t kTriangles = 4;  // the mode of a primitive, by glTF's numbers

absl::Status Append(GltfDocument& file, const json& primitive, GltfSurface& surface) {
  const json& mode = Member(primitive, "mode");
  if (!mode.is_null() && Whole(mode) != kTriangles) return absl::OkStatus();
  const json& position = Member(Member(primitive, "attributes"), "POSITION");
  ASSIGN_OR_RETURN(const std::vector<float> vertices,
                   ReadFloats(file, position, "POSITION", "VEC3"));
  std::vector<uint32_t> triangles(vertices.size() / 3);
  std::iota(triangles.begin(), triangles.end(), 0U);
  if (const json& indices = Member(primitive, "indices"); !indices.is_null()) {
    ASSIGN_OR_RETURN(triangles, ReadIndices(file, indices, "indices of the mesh"));
  }
  RETURN_IF_ERROR(CheckTriangles(triangles, vertices.size() / 3));
  const auto first = static_cast<uint32_t>(surface.vertices.size() / 3);
  for (const uint32_t vertex : triangles) surface.triangles.push_back(first + vertex);
  surface.vertices.insert(surface.vertices.end(), vertices.begin(), vertices.end());
  return absl::OkStatus();
}

double SquaredDistance(const float* a, const float* b) {
  const double x = double{a[0]} - b[0], y = double{a[1]} - b[1], z = double{a[2]} - b[2];
  return x * x + y * y + z * z;
}

/// Returns the point nearest to `place`. The points in `order` ascend by x; the search goes
/// outwards from the x of `place` until the distance in x alone exceeds the least distance found.
uint32_t Nearest(const std::vector<float>& points, const std::vector<uint32_t>& order,
                 const float* place) {
  const auto x = [&](uint32_t point) { return points[3 * size_t{point}]; };
  auto right = std::ranges::lower_bound(order, place[0], {}, x);
  auto left = right;
  uint32_t best = order.front();
  double distance = std::numeric_limits<double>::infinity();
  const auto take = [&](uint32_t point) {
    const double along_x = double{x(point)} - place[0];
    if (along_x * along_x > distance) return false;
    const double here = SquaredDistance(&points[3 * size_t{point}], place);
    if (here < distance) best = point;
    distance = std::min(distance, here);
    return true;
  };
  while (right != order.end() || left != order.begin()) {
    if (right != order.end()) right = take(*right) ? right + 1 : order.end();
    if (left != order.begin()) left = take(*(left - 1)) ? left - 1 : order.begin();
  }
  return best;
}

}  // namespace

absl::StatusOr<GltfSurface> ReadMesh(GltfDocument& file, uint64_t mesh) {
  const json& meshes = Member(file.root(), "meshes");
  if (!meshes.is_array() || mesh >= meshes.size())
    return Malformed(absl::StrCat("there is no mesh ", mesh));
  GltfSurface surface;
  const json& primitives = Member(meshes[mesh], "primitives");
  for (const json& primitive : primitives.is_array() ? primitives : json::array()) {
    RETURN_IF_ERROR(Append(file, primitive, surface));
  }
  if (!surface.triangles.empty()) return surface;
  return Incomplete(absl::StrCat("mesh ", mesh, " has no triangles"), "store it as triangles");
}

absl::Status CheckTriangles(const std::vector<uint32_t>& triangles, size_t vertex_count) {
  if (triangles.empty() || triangles.size() % 3 != 0) {
    return Malformed(
        absl::StrCat("triangles have three corners each, not ", triangles.size(), " in all"));
  }
  const uint32_t most = std::ranges::max(triangles);
  if (most < vertex_count) return absl::OkStatus();
  return Malformed(
      absl::StrCat("a triangle names vertex ", most, ", but there are ", vertex_count));
}

std::vector<uint32_t> NearestPoints(const std::vector<float>& points,
                                    const std::vector<float>& places) {
  std::vector<uint32_t> order(points.size() / 3);
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](uint32_t point) { return points[3 * size_t{point}]; });
  std::vector<uint32_t> nearest;
  for (size_t i = 0; i + 2 < places.size(); i += 3) {
    nearest.push_back(Nearest(points, order, &places[i]));
  }
  return nearest;
}

}  // namespace carillon::interchange
