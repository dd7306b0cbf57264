// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/mesh_limits.h"
#include "precompute/mesh/read/gltf_document.h"
#include "precompute/mesh/read/surface_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"

namespace carillon::precompute {
namespace {

using Json = nlohmann::json;
/// A matrix of 4 by 4, column after column.
using Matrix = std::array<double, 16>;

constexpr Matrix kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix product{};
  for (size_t i = 0; i < 16; ++i) {
    for (size_t k = 0; k < 4; ++k) product[i] += a[i % 4 + 4 * k] * b[i / 4 * 4 + k];
  }
  return product;
}

Point Moved(const Matrix& m, const Point& p) {
  Point moved;
  for (size_t x = 0; x < 3; ++x)
    moved[x] = m[x] * p[0] + m[4 + x] * p[1] + m[8 + x] * p[2] + m[12 + x];
  return moved;
}

bool IsMirroring(const Matrix& m) {
  return m[0] * (m[5] * m[10] - m[9] * m[6]) - m[4] * (m[1] * m[10] - m[9] * m[2]) +
             m[8] * (m[1] * m[6] - m[5] * m[2]) <
         0;
}

/// The transformation of a node: a matrix, or translation * rotation * scale.
Matrix MatrixOf(const Json& node) {
  if (node.contains("matrix")) return node.at("matrix").get<Matrix>();
  const auto t = node.value("translation", std::array<double, 3>{0, 0, 0});
  const auto [x, y, z, w] = node.value("rotation", std::array<double, 4>{0, 0, 0, 1});
  const auto s = node.value("scale", std::array<double, 3>{1, 1, 1});
  return {s[0] * (1 - 2 * (y * y + z * z)),
          s[0] * 2 * (x * y + z * w),
          s[0] * 2 * (x * z - y * w),
          0,
          s[1] * 2 * (x * y - z * w),
          s[1] * (1 - 2 * (x * x + z * z)),
          s[1] * 2 * (y * z + x * w),
          0,
          s[2] * 2 * (x * z + y * w),
          s[2] * 2 * (y * z - x * w),
          s[2] * (1 - 2 * (x * x + y * y)),
          0,
          t[0],
          t[1],
          t[2],
          1};
}

std::vector<Point> ToPoints(const GltfValues& values) {
  std::vector<Point> points(values.count());
  for (size_t i = 0; i < values.values.size(); ++i) points[i / 3][i % 3] = values.values[i];
  return points;
}

/// Reads the surfaces of a scene where the scene places them: with the weights of morph targets
/// that the file gives, and with skins as their joints stand.
class GltfScene {
 public:
  GltfScene(std::string_view text, std::string_view binary) : document_(text, binary) {}

  SurfaceFile Read() && {
    file_.has_numbers = false;
    FindParents();
    std::vector<Json> waiting = Roots();
    if (node_count() == 0) {
      const size_t mesh_count = document_.root().value("meshes", Json::array()).size();
      for (size_t m = 0; m < mesh_count; ++m) AddMesh({{"mesh", m}}, kIdentity);
    }
    while (!waiting.empty()) {
      const Json index = waiting.back();
      waiting.pop_back();
      const Json& node = document_.At("nodes", index);
      CheckExtensions(node);
      if (node.contains("mesh")) AddMesh(node, World(index.get<size_t>()));
      for (const Json& child : node.value("children", Json::array())) waiting.push_back(child);
    }
    if (has_lines_) file_.warnings.emplace_back("points and lines of the file were left out");
    return std::move(file_);
  }

 private:
  size_t node_count() const { return parents_.size(); }

  void FindParents() {
    const Json nodes = document_.root().value("nodes", Json::array());
    parents_.resize(nodes.size());
    for (size_t n = 0; n < nodes.size(); ++n) {
      for (const Json& child : nodes[n].value("children", Json::array())) {
        document_.At("nodes", child);
        std::optional<size_t>& parent = parents_[child.get<size_t>()];
        if (parent)
          FailGltf(absl::StrCat("node ", child.get<size_t>(), " is a child of two nodes"));
        parent = n;
      }
    }
    for (size_t n = 0; n < nodes.size(); ++n) World(n);  // so that no node is its own ancestor
  }

  /// The nodes of the scene that is shown, or where there is none, those without a parent.
  std::vector<Json> Roots() {
    const Json scenes = document_.root().value("scenes", Json::array());
    if (!scenes.empty()) {
      if (scenes.size() > 1) {
        file_.warnings.push_back(
            absl::StrCat("the file has ", scenes.size(),
                         " scenes, of which only the one that it shows was read"));
      }
      const Json& scene = document_.At("scenes", document_.root().value("scene", Json(0U)));
      return scene.value("nodes", std::vector<Json>());
    }
    std::vector<Json> roots;
    for (size_t n = 0; n < node_count(); ++n) {
      if (!parents_[n]) roots.emplace_back(n);
    }
    return roots;
  }

  /// The matrix from a node's frame to that of the scene.
  Matrix World(size_t node) const {
    Matrix world = kIdentity;
    size_t steps = 0;
    for (std::optional<size_t> n = node; n; n = parents_[*n]) {
      if (steps++ > node_count()) FailGltf(absl::StrCat("node ", node, " is its own ancestor"));
      world = Product(MatrixOf(document_.At("nodes", *n)), world);
    }
    return world;
  }

  static void CheckExtensions(const Json& node) {
    const Json extensions = node.value("extensions", Json::object());
    if (extensions.contains("EXT_mesh_gpu_instancing")) {
      FailGltf(
          "a node places its mesh by EXT_mesh_gpu_instancing, which is not read: write its "
          "instances as nodes (\"gltf-transform uninstance IN OUT\")");
    }
    const auto visibility = extensions.find("KHR_node_visibility");
    if (visibility != extensions.end() && !visibility->value("visible", true)) {
      FailGltf("it hides a node (KHR_node_visibility): leave out what does not belong to the body");
    }
  }

  void AddMesh(const Json& node, const Matrix& world) {
    const Json& mesh = document_.At("meshes", node.at("mesh"));
    const Json weights = node.value("weights", mesh.value("weights", Json::array()));
    for (const Json& primitive : mesh.at("primitives"))
      AddPrimitive(primitive, node, weights, world);
  }

  void AddPrimitive(const Json& primitive, const Json& node, const Json& weights,
                    const Matrix& world) {
    const int mode = primitive.value("mode", 4);
    if (mode < 4) {  // points and lines bound nothing
      has_lines_ = true;
      return;
    }
    if (mode > 6) FailGltf(absl::StrCat("a primitive has the mode ", mode));
    const Json& attributes = primitive.at("attributes");
    if (primitive.value("extensions", Json::object()).contains("KHR_draco_mesh_compression") &&
        !document_.At("accessors", attributes.at("POSITION")).contains("bufferView")) {
      FailGltf(
          "its surface is compressed by KHR_draco_mesh_compression, which is not read: re-export "
          "the body uncompressed");
    }
    std::vector<Point> points = ToPoints(document_.Read(attributes.at("POSITION"), "VEC3"));
    Morph(primitive, weights, points);
    const bool is_skinned = node.contains("skin") && attributes.contains("JOINTS_0");
    if (is_skinned) {
      Bend(document_.At("skins", node.at("skin")), attributes, points);
    } else {
      for (Point& p : points) p = Moved(world, p);
    }
    AddTriangles(mode, Corners(primitive, points.size()), points,
                 !is_skinned && IsMirroring(world));
  }

  /// Adds the morph targets to the points, each by its weight.
  void Morph(const Json& primitive, const Json& weights, std::vector<Point>& points) const {
    const Json targets = primitive.value("targets", Json::array());
    for (size_t t = 0; t < std::min(targets.size(), weights.size()); ++t) {
      const double weight = weights[t].get<double>();
      if (weight == 0 || !targets[t].contains("POSITION")) continue;
      const std::vector<Point> moves = ToPoints(document_.Read(targets[t].at("POSITION"), "VEC3"));
      if (moves.size() != points.size()) FailGltf("a morph target has another number of vertices");
      for (size_t i = 0; i < points.size(); ++i) {
        for (size_t x = 0; x < 3; ++x) points[i][x] += weight * moves[i][x];
      }
    }
  }

  /// Moves points by the joints of a skin. The node that has the skin does not move them.
  void Bend(const Json& skin, const Json& attributes, std::vector<Point>& points) const {
    const Json& joints = skin.at("joints");
    std::vector<Matrix> matrices;
    GltfValues inverse{.width = 16, .values = {}};
    if (skin.contains("inverseBindMatrices")) {
      inverse = document_.Read(skin.at("inverseBindMatrices"), "MAT4");
      if (inverse.count() < joints.size()) FailGltf("a skin has fewer matrices than joints");
    }
    for (size_t j = 0; j < joints.size(); ++j) {
      document_.At("nodes", joints[j]);
      matrices.push_back(World(joints[j].get<size_t>()));
      if (inverse.values.empty()) continue;
      Matrix bind;
      std::copy_n(inverse.values.begin() + static_cast<ptrdiff_t>(16 * j), 16, bind.begin());
      matrices.back() = Product(matrices.back(), bind);
    }
    std::vector<Point> bent(points.size(), Point{0, 0, 0});
    for (int set = 0; attributes.contains(absl::StrCat("JOINTS_", set)); ++set) {
      const GltfValues of = document_.Read(attributes.at(absl::StrCat("JOINTS_", set)), "VEC4");
      const GltfValues by = document_.Read(attributes.at(absl::StrCat("WEIGHTS_", set)), "VEC4");
      if (of.count() != points.size() || by.count() != points.size()) {
        FailGltf("a skin has another number of weights than vertices");
      }
      for (size_t i = 0; i < of.values.size(); ++i) {
        if (by.values[i] == 0) continue;
        if (of.values[i] >= static_cast<double>(matrices.size())) {
          FailGltf("a vertex names a joint that its skin does not have", "MESH_INDEX_OUT_OF_RANGE");
        }
        const Point moved = Moved(matrices[static_cast<size_t>(of.values[i])], points[i / 4]);
        for (size_t x = 0; x < 3; ++x) bent[i / 4][x] += by.values[i] * moved[x];
      }
    }
    points = std::move(bent);
  }

  /// The indices of a primitive's corners; without an accessor each vertex is one corner.
  std::vector<size_t> Corners(const Json& primitive, size_t point_count) const {
    std::vector<size_t> corners(point_count);
    for (size_t i = 0; i < point_count; ++i) corners[i] = i;
    if (!primitive.contains("indices")) return corners;
    const GltfValues indices = document_.Read(primitive.at("indices"), "SCALAR");
    corners.clear();
    for (const double index : indices.values) {
      if (!(index >= 0 && index < static_cast<double>(point_count)) || index != std::floor(index)) {
        FailGltf(absl::StrCat("a triangle names vertex ", index, " of ", point_count,
                              " (counted from zero): export the mesh again"),
                 "MESH_INDEX_OUT_OF_RANGE");
      }
      corners.push_back(static_cast<size_t>(index));
    }
    return corners;
  }

  /// Triangles (mode 4), strips (5), of which every second triangle is turned, and fans (6).
  void AddTriangles(int mode, const std::vector<size_t>& corners, const std::vector<Point>& points,
                    bool turned) {
    if (mode == 4 && corners.size() % 3 != 0) {
      FailGltf(absl::StrCat("a primitive of triangles has ", corners.size(), " corners"));
    }
    for (size_t i = 0; i + 2 < corners.size(); i += mode == 4 ? 3 : 1) {
      std::array<Point, 3> triangle = {points[corners[mode == 6 ? 0 : i]], points[corners[i + 1]],
                                       points[corners[i + 2]]};
      if (turned != (mode == 5 && i % 2 == 1)) std::swap(triangle[1], triangle[2]);
      if (file_.ends.size() >= static_cast<size_t>(kMaxSurfaceTriangles)) {
        FailGltf(absl::StrCat("its scene has more than ", kMaxSurfaceTriangles,
                              " triangles: simplify it, or leave out parts"),
                 "MESH_TOO_LARGE");
      }
      file_.AddTriangle(triangle);
    }
  }

  GltfDocument document_;
  SurfaceFile file_;
  std::vector<std::optional<size_t>> parents_;
  bool has_lines_ = false;
};

absl::StatusOr<SurfaceFile> ParseScene(std::string_view text, std::string_view binary) {
  try {
    return GltfScene(text, binary).Read();
  } catch (const GltfFault& fault) {
    return fault.status();
  } catch (const Json::exception& fault) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   absl::StrCat("the file cannot be read as glTF: ",
                                EscapedText(std::string_view(fault.what()).substr(0, 200)),
                                ". Name its right format, or export it again"));
  }
}

absl::Status GlbUnreadable(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                 absl::StrCat(what, ": export it again"));
}

/// The first two chunks of a GLB: the document and its binary data.
absl::StatusOr<std::array<std::string_view, 2>> FindChunks(std::string_view bytes) {
  constexpr size_t kHeader = 12, kChunkHeader = 8, kVersionAt = 4;
  const auto number = [&](size_t at) {
    uint32_t value = 0;  // little-endian, as this machine
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  if (bytes.size() < kHeader + kChunkHeader || !bytes.starts_with("glTF")) {
    return GlbUnreadable("a GLB file begins with \"glTF\", a header of 12 bytes and a chunk");
  }
  if (number(kVersionAt) != 2) {
    return GlbUnreadable(
        absl::StrCat("the GLB file has version ", number(kVersionAt), " where 2 is read"));
  }
  constexpr uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  std::array<std::string_view, 2> chunks;
  for (size_t at = kHeader; at + kChunkHeader <= bytes.size();) {
    const size_t length = number(at), left = bytes.size() - at - kChunkHeader;
    if (length > left) {
      return GlbUnreadable(absl::StrCat("the chunk at byte ", at,
                                        " of the GLB file says that it has ", length,
                                        " bytes, and the file has ", left, " more"));
    }
    const uint32_t kind = number(at + 4);
    if (kind == kJson && at == kHeader) chunks[0] = bytes.substr(at + kChunkHeader, length);
    if (kind == kBinary && chunks[1].empty()) chunks[1] = bytes.substr(at + kChunkHeader, length);
    at += kChunkHeader + length;
  }
  return chunks;
}

}  // namespace

absl::StatusOr<SurfaceFile> ParseGltf(const std::string& bytes) { return ParseScene(bytes, {}); }

absl::StatusOr<SurfaceFile> ParseGlb(const std::string& bytes) {
  const auto chunks = FindChunks(bytes);
  if (!chunks.ok()) return chunks.status();
  return ParseScene((*chunks)[0], (*chunks)[1]);
}

}  // namespace carillon::precompute
