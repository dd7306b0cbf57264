// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_surface.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"
#include "proto/cpp/gltf/gltf_surface.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

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

absl::StatusOr<MeshSurface> ReadMesh(const GltfDocument& file, uint64_t mesh) {
  MeshSurface whole;
  for (const json& primitive : file.At("meshes", mesh).at("primitives")) {
    const GltfSurface part = ReadPrimitive(file, primitive, json());
    const auto first = static_cast<uint32_t>(whole.vertices.size() / 3);
    for (const uint32_t vertex : part.corners) whole.triangles.push_back(first + vertex);
    for (const GltfPoint& point : part.points) {
      for (const double x : point) whole.vertices.push_back(static_cast<float>(x));
    }
  }
  if (!whole.triangles.empty()) return whole;
  return Incomplete(absl::StrCat("mesh ", mesh, " has no triangles"), "store it as triangles");
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
