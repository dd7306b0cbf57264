// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/gltf/gltf_surface.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

using Json = nlohmann::json;

constexpr int kTriangles = 4, kStrip = 5, kFan = 6;

std::vector<GltfPoint> ReadPoints(const GltfDocument& document, const Json& accessor) {
  const std::vector<double> numbers = document.Read<double>(accessor, "VEC3");
  std::vector<GltfPoint> points(numbers.size() / 3);
  for (size_t i = 0; i < numbers.size(); ++i) points[i / 3][i % 3] = numbers[i];
  return points;
}

/// Adds the morph targets to the points, each by its weight.
void Morph(const GltfDocument& document, const Json& targets, const Json& weights,
           std::vector<GltfPoint>& points) {
  for (size_t t = 0; t < std::min(targets.size(), weights.size()); ++t) {
    const double weight = weights[t].get<double>();
    if (weight == 0 || !targets[t].contains("POSITION")) continue;
    const std::vector<GltfPoint> moves = ReadPoints(document, targets[t].at("POSITION"));
    if (moves.size() != points.size()) {
      throw GltfFault("a morph target has another number of vertices");
    }
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t x = 0; x < 3; ++x) points[i][x] += weight * moves[i][x];
    }
  }
}

/// Returns three corners for each triangle of a list, of a strip, of which every second triangle is
/// turned, or of a fan.
std::vector<uint32_t> Triangles(int mode, std::vector<uint32_t> corners) {
  if (mode == kTriangles) {
    if (corners.size() % 3 == 0) return corners;
    throw GltfFault(absl::StrCat("a primitive of triangles has ", corners.size(), " corners"));
  }
  std::vector<uint32_t> triangles;
  for (size_t i = 0; i + 2 < corners.size(); ++i) {
    const bool turned = mode == kStrip && i % 2 == 1;
    triangles.insert(triangles.end(), {corners[mode == kFan ? 0 : i], corners[i + (turned ? 2 : 1)],
                                       corners[i + (turned ? 1 : 2)]});
  }
  return triangles;
}

/// Returns the matrices by which the joints of a skin move its vertices.
std::vector<GltfMatrix> Joints(const GltfDocument& document, const Json& skin,
                               const std::vector<GltfMatrix>& worlds) {
  std::vector<double> inverse;
  if (skin.contains("inverseBindMatrices")) {
    inverse = document.Read<double>(skin.at("inverseBindMatrices"), "MAT4");
    if (inverse.size() / 16 < skin.at("joints").size()) {
      throw GltfFault("a skin has fewer matrices than joints");
    }
  }
  std::vector<GltfMatrix> matrices;
  for (const Json& joint : skin.at("joints")) {
    GltfMatrix matrix = worlds[document.IndexIn("nodes", joint)];
    if (!inverse.empty()) {
      GltfMatrix bind;
      std::copy_n(&inverse[16 * matrices.size()], 16, bind.begin());
      matrix = Product(matrix, bind);
    }
    matrices.push_back(matrix);
  }
  return matrices;
}

/// Moves points by the joints of a skin. The node that has the skin does not move them. Weights of
/// eight bits rarely add up to one, so that each point is divided by the sum of its weights.
void Bend(const GltfDocument& document, const std::vector<GltfMatrix>& joints,
          const Json& attributes, std::vector<GltfPoint>& points) {
  std::vector<GltfPoint> bent(points.size(), GltfPoint{0, 0, 0});
  std::vector<double> sums(points.size());
  for (int set = 0; attributes.contains(absl::StrCat("JOINTS_", set)); ++set) {
    const auto of = document.Read<float>(attributes.at(absl::StrCat("JOINTS_", set)), "VEC4");
    const auto by = document.Read<double>(attributes.at(absl::StrCat("WEIGHTS_", set)), "VEC4");
    if (of.size() != 4 * points.size() || by.size() != of.size()) {
      throw GltfFault("a skin has another number of weights than vertices");
    }
    for (size_t i = 0; i < of.size(); ++i) {
      if (by[i] == 0) continue;
      if (!(of[i] >= 0 && of[i] < static_cast<float>(joints.size()))) {
        throw GltfFault("a vertex names a joint that its skin does not have");
      }
      const GltfPoint moved = Moved(joints[static_cast<size_t>(of[i])], points[i / 4]);
      for (size_t x = 0; x < 3; ++x) bent[i / 4][x] += by[i] * moved[x];
      sums[i / 4] += by[i];
    }
  }
  for (size_t p = 0; p < points.size(); ++p) {
    if (!(sums[p] > 0)) {
      throw GltfFault(absl::StrCat("vertex ", p,
                                   " (counted from zero) has no weight for any joint of its skin: "
                                   "export the body without its skin, or weigh all vertices"));
    }
    for (size_t x = 0; x < 3; ++x) points[p][x] = bent[p][x] / sums[p];
  }
}

}  // namespace

GltfSurface ReadPrimitive(const GltfDocument& document, const Json& primitive,
                          const Json& weights) {
  const int mode = primitive.value("mode", kTriangles);
  if (mode < kTriangles) return {};
  if (mode > kFan) throw GltfFault(absl::StrCat("a primitive has the mode ", mode));
  GltfSurface surface;
  if (primitive.contains("material")) {
    const Json& number = primitive.at("material");
    surface.material = document.At("materials", number).value("name", number.dump());
  }
  surface.points = ReadPoints(document, primitive.at("attributes").at("POSITION"));
  Morph(document, primitive.value("targets", Json::array()), weights, surface.points);
  // Without an accessor each vertex is one corner.
  std::vector<uint32_t> corners(surface.points.size());
  std::iota(corners.begin(), corners.end(), 0U);
  if (primitive.contains("indices")) {
    corners = document.ReadIndices(primitive.at("indices"), surface.points.size());
  }
  surface.corners = Triangles(mode, std::move(corners));
  return surface;
}

std::vector<GltfSurface> ReadPlacedMesh(const GltfDocument& document, size_t node,
                                        const std::vector<GltfMatrix>& worlds) {
  const Json& placed = document.At("nodes", node);
  if (placed.value("extensions", Json::object()).contains("EXT_mesh_gpu_instancing")) {
    throw GltfFault(
        "a node places its mesh by EXT_mesh_gpu_instancing, which is not read: write its instances "
        "as nodes (\"gltf-transform uninstance IN OUT\")");
  }
  const Json& mesh = document.At("meshes", placed.at("mesh"));
  const Json weights = placed.value("weights", mesh.value("weights", Json::array()));
  std::vector<GltfSurface> surfaces;
  for (const Json& primitive : mesh.at("primitives")) {
    surfaces.push_back(ReadPrimitive(document, primitive, weights));
    GltfSurface& surface = surfaces.back();
    if (surface.corners.empty()) continue;
    const Json& attributes = primitive.at("attributes");
    if (placed.contains("skin") && attributes.contains("JOINTS_0")) {
      const Json& skin = document.At("skins", placed.at("skin"));
      Bend(document, Joints(document, skin, worlds), attributes, surface.points);
    } else {
      for (GltfPoint& point : surface.points) point = Moved(worlds[node], point);
      if (IsMirroring(worlds[node])) {
        for (size_t i = 0; i < surface.corners.size(); i += 3) {
          std::swap(surface.corners[i + 1], surface.corners[i + 2]);
        }
      }
    }
  }
  return surfaces;
}

}  // namespace carillon
