// SPDX-License-Identifier: AGPL-3.0-or-later
//
// A tetrahedron with edges of 1 m along the axes, in the ways in which glTF 2.0 can give it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"

namespace carillon::precompute {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr int kUint8 = 5121, kUint16 = 5123, kFloat = 5126;

/// A document whose accessors are added one after the other.
class Document {
 public:
  Document() {
    root_ = {{"asset", {{"version", "2.0"}}}, {"scene", 0},
             {"scenes", {{{"nodes", {0}}}}},  {"nodes", {{{"mesh", 0}}}},
             {"accessors", Json::array()},    {"bufferViews", Json::array()}};
    points_ = Add<float>("VEC3", kFloat, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
    const size_t corners = Add<uint8_t>("SCALAR", kUint8, {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
    root_["meshes"] = {
        {{"primitives", {{{"attributes", {{"POSITION", points_}}}, {"indices", corners}}}}}};
  }

  Json& root() { return root_; }
  Json& primitive() { return root_["meshes"][0]["primitives"][0]; }
  size_t points() const { return points_; }
  const std::string& data() const { return data_; }

  template <typename T>
  size_t AddView(const std::vector<T>& values) {
    root_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", data_.size()}, {"byteLength", values.size() * sizeof(T)}});
    data_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    data_.resize((data_.size() + 3) / 4 * 4);
    return root_["bufferViews"].size() - 1;
  }

  template <typename T>
  size_t Add(const std::string& type, int component, const std::vector<T>& values) {
    const size_t width = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
    root_["accessors"].push_back({{"bufferView", AddView(values)},
                                  {"componentType", component},
                                  {"count", values.size() / width},
                                  {"type", type}});
    return root_["accessors"].size() - 1;
  }

  std::string Text() const {
    return Text("data:application/octet-stream;base64," + absl::Base64Escape(data_));
  }
  /// With the bytes at another place.
  std::string Text(const std::string& uri) const {
    Json all = root_;
    all["buffers"] = {{{"byteLength", data_.size()}, {"uri", uri}}};
    return all.dump();
  }

 private:
  Json root_;
  std::string data_;
  size_t points_ = 0;
};

class ReadGltfTest : public ReadMeshTest {
 protected:
  void ExpectVolume(const Document& document, double volume, double tolerance = 1e-7) const {
    const std::vector<Shell> shells = FindShells(ReadSurfaceOf(document.Text(), "gltf"));
    ASSERT_EQ(shells.size(), 1U);
    EXPECT_NEAR(shells[0].volume_m3, volume, tolerance);
  }
};

TEST_F(ReadGltfTest, PartsAreThereAsOftenAsTheSceneHasThem) {
  Document document;
  document.root()["nodes"].push_back({{"mesh", 0}, {"translation", {5, 0, 0}}});
  const SurfaceMesh once = ReadSurfaceOf(document.Text(), "gltf");
  EXPECT_EQ(once.triangles.size(), 4U);
  EXPECT_EQ(once.vertices.size(), 4U);
  document.root()["scenes"][0]["nodes"] = {0, 1};
  EXPECT_EQ(ReadSurfaceOf(document.Text(), "gltf").triangles.size(), 8U);
}

TEST_F(ReadGltfTest, NoFileBesideItIsRead) {
  Document document;
  const std::string outside = testing::TempDir() + "outside_of_gltf.bin";
  std::ofstream(outside, std::ios::binary) << document.data();
  EXPECT_THAT(Refused(document.Text(outside), "gltf"),
              AllOf(HasSubstr("MESH_UNREADABLE"), HasSubstr("which did not come with it")));
  std::filesystem::remove(outside);
}

TEST_F(ReadGltfTest, AMirroredNodeKeepsItsSurfaceOutside) {
  for (const double x : {-1.0, 1.0}) {
    Document document;
    document.root()["nodes"][0]["scale"] = {x, 1, 1};
    ExpectVolume(document, 1.0 / 6);
  }
}

TEST_F(ReadGltfTest, AChildIsPlacedByItsParents) {
  Document document;
  const double half = std::sqrt(0.5);
  document.root()["nodes"] = {{{"children", {1}}, {"rotation", {0, 0, half, half}}},
                              {{"mesh", 0}, {"translation", {2, 0, 0}}, {"scale", {1, 1, 3}}}};
  const SurfaceMesh body = ReadSurfaceOf(document.Text(), "gltf");
  // A quarter turn about z puts (2 + 1, 0, 0) at (0, 3, 0).
  EXPECT_TRUE(std::ranges::any_of(body.vertices, [](const Point& p) {
    return Distance(p, {0, 3, 0}) < 1e-6;
  }));
  ExpectVolume(document, 0.5, 1e-6);
}

TEST_F(ReadGltfTest, QuantizedPositionsAreReadAsTheNodeScalesThem) {
  for (const bool normalized : {false, true}) {
    Document document;
    // Padded to eight bytes each.
    const size_t view =
        document.AddView<uint16_t>({0, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0, 0, 0, 0, 65535, 0});
    document.root()["bufferViews"][view]["byteStride"] = 8;
    document.root()["accessors"][document.points()] = {{"bufferView", view},
                                                       {"componentType", kUint16},
                                                       {"count", 4},
                                                       {"type", "VEC3"},
                                                       {"normalized", normalized}};
    const double scale = normalized ? 1 : 1.0 / 65535;
    document.root()["nodes"][0]["scale"] = {scale, scale, scale};
    document.root()["extensionsRequired"] = {"KHR_mesh_quantization"};
    ExpectVolume(document, 1.0 / 6);
  }
}

TEST_F(ReadGltfTest, ASparseAccessorChangesOrMakesPositions) {
  for (const bool has_base : {false, true}) {
    Document document;
    const size_t indices = document.AddView<uint8_t>({1, 2, 3});
    const size_t values = document.AddView<float>({1, 0, 0, 0, 1, 0, 0, 0, 2});
    Json& points = document.root()["accessors"][document.points()];
    if (!has_base) points.erase("bufferView");
    points["sparse"] = {{"count", 3},
                        {"indices", {{"bufferView", indices}, {"componentType", kUint8}}},
                        {"values", {{"bufferView", values}}}};
    ExpectVolume(document, 2.0 / 6);
  }
}

TEST_F(ReadGltfTest, MorphTargetsAreAddedByTheirWeights) {
  Document document;
  const size_t moves = document.Add<float>("VEC3", kFloat, {0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0});
  document.primitive()["targets"] = {{{"POSITION", moves}}};
  document.root()["meshes"][0]["weights"] = {0.5};
  ExpectVolume(document, 2.0 / 6);
}

/// A rig at a hundredth, as exporters write bodies in centimetres.
TEST_F(ReadGltfTest, ASkinIsBentAsItsJointsStand) {
  for (const bool has_inverse : {false, true}) {
    Document document;
    document.root()["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {7, 7, 7}}},
                                {{"scale", {0.01, 0.01, 0.01}}}};
    document.root()["skins"] = {{{"joints", {1}}}};
    std::vector<float> inverse(16);
    for (size_t i = 0; i < 4; ++i) inverse[5 * i] = i < 3 ? 200 : 1;
    if (has_inverse) {
      document.root()["skins"][0]["inverseBindMatrices"] =
          document.Add<float>("MAT4", kFloat, inverse);
    }
    document.primitive()["attributes"]["JOINTS_0"] =
        document.Add<uint8_t>("VEC4", kUint8, std::vector<uint8_t>(16, 0));
    document.primitive()["attributes"]["WEIGHTS_0"] =
        document.Add<float>("VEC4", kFloat, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
    const double side = has_inverse ? 2 : 0.01;
    const double cube = side * side * side;
    ExpectVolume(document, cube / 6, 1e-6 * cube);
  }
}

/// Weights of eight bits, of which a whole is 255, seldom add up to a whole.
TEST_F(ReadGltfTest, WeightsOfASkinAreSharesOfTheirSum) {
  Document document;
  document.root()["nodes"] = {{{"mesh", 0}, {"skin", 0}}, {{"translation", {0, 0, 0}}}};
  document.root()["skins"] = {{{"joints", {1, 1}}}};
  document.primitive()["attributes"]["JOINTS_0"] =
      document.Add<uint8_t>("VEC4", kUint8, {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0});
  const size_t weights = document.Add<uint8_t>(
      "VEC4", kUint8, {127, 123, 0, 0, 200, 50, 0, 0, 9, 1, 0, 0, 255, 1, 0, 0});
  document.root()["accessors"][weights]["normalized"] = true;
  document.primitive()["attributes"]["WEIGHTS_0"] = weights;
  ExpectVolume(document, 1.0 / 6, 1e-6);
  document.primitive()["attributes"]["WEIGHTS_0"] =
      document.Add<float>("VEC4", kFloat, {1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  EXPECT_THAT(Refused(document.Text(), "gltf"),
              HasSubstr("vertex 1 (counted from zero) has no weight"));
}

TEST_F(ReadGltfTest, StripsAndFansAreTriangles) {
  Document strip;
  strip.primitive()["mode"] = 5;
  strip.primitive()["indices"] = strip.Add<uint8_t>("SCALAR", kUint8, {0, 2, 1, 3, 0, 2});
  ExpectVolume(strip, 1.0 / 6);
  Document fan;
  fan.primitive()["mode"] = 6;
  fan.primitive()["indices"] = fan.Add<uint8_t>("SCALAR", kUint8, {3, 0, 1, 2, 0});
  Json base = fan.primitive();
  base["indices"] = fan.Add<uint8_t>("SCALAR", kUint8, {0, 2, 1});
  fan.root()["meshes"][0]["primitives"].push_back(base);
  ExpectVolume(fan, 1.0 / 6);
}

TEST_F(ReadGltfTest, WhatIsNotReadIsRefusedByNameWithTheWayOut) {
  for (const auto& [extension, way_out] :
       {std::pair{"EXT_meshopt_compression", "gltfpack -i IN -o OUT -noq"},
        {"KHR_draco_mesh_compression", "re-export the body uncompressed"},
        {"EXT_mesh_gpu_instancing", "gltf-transform uninstance"},
        {"EXT_unheard_of", "without it"}}) {
    Document document;
    document.root()["extensionsRequired"] = {extension};
    EXPECT_THAT(Refused(document.Text(), "gltf"),
                AllOf(HasSubstr("MESH_UNREADABLE"), HasSubstr(extension), HasSubstr(way_out)));
  }
  Document instanced;
  instanced.root()["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = Json::object();
  EXPECT_THAT(Refused(instanced.Text(), "gltf"), HasSubstr("EXT_mesh_gpu_instancing"));
  Document first;
  first.root()["asset"]["version"] = "1.0";
  EXPECT_THAT(Refused(first.Text(), "gltf"), HasSubstr("its version is \"1.0\""));
}

TEST_F(ReadGltfTest, ExtensionsOfMaterialsAreHarmless) {
  Document document;
  document.root()["extensionsRequired"] = {"KHR_materials_transmission", "KHR_texture_transform"};
  document.root()["extensionsUsed"] = {"EXT_unheard_of"};
  EXPECT_EQ(ReadSurfaceOf(document.Text(), "gltf").triangles.size(), 4U);
}

TEST_F(ReadGltfTest, IndicesOutOfRangeAreRefused) {
  Document corner;
  corner.primitive()["indices"] = corner.Add<uint8_t>("SCALAR", kUint8, {0, 2, 4});
  EXPECT_THAT(
      Refused(corner.Text(), "gltf"),
      HasSubstr(
          "MESH_UNREADABLE: the file cannot be read as glTF: a triangle names vertex 4 of 4"));
  Document node;
  node.root()["scenes"][0]["nodes"] = {3};
  EXPECT_THAT(Refused(node.Text(), "gltf"), HasSubstr("names element \"3\" of its 1 nodes"));
  Document ancestor;
  ancestor.root()["nodes"][0]["children"] = {0};
  EXPECT_THAT(Refused(ancestor.Text(), "gltf"), HasSubstr("is its own ancestor"));
  Document view;
  view.root()["accessors"][view.points()]["count"] = 5;
  EXPECT_THAT(Refused(view.Text(), "gltf"), HasSubstr("reaches beyond its buffer view"));
}

TEST_F(ReadGltfTest, BytesThatAreNoDocumentAreRefusedInShort) {
  const std::string refusal =
      Refused("{\"asset\": \"" + std::string(100'000, 'x') + "\xe9\"}", "gltf");
  EXPECT_THAT(refusal, HasSubstr("MESH_UNREADABLE: the file cannot be read as glTF: "));
  EXPECT_LT(refusal.size(), 600U);
}

}  // namespace
}  // namespace carillon::precompute
