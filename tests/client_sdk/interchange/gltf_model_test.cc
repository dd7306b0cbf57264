// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_model.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "absl/strings/escaping.h"
#include "client_sdk/interchange/damping.h"
#include "proto/cpp/material_catalogue.h"
#include "tests/client_sdk/interchange/small_model.h"

namespace carillon::interchange {
namespace {

using google::protobuf::util::MessageDifferencer;
using nlohmann::json;
using testing::HasSubstr;
using testing::TempDir;

// Single precision, twice rounded.
constexpr double kTolerance = 2.5e-7;

template <class T>
void ExpectNear(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i], b[i], kTolerance * std::abs(double{b[i]})) << i;
  }
}

class GltfModelTest : public testing::Test {
 protected:
  absl::Status Write(const v1::Material& material = SmallMaterial()) const {
    return WriteGltfModel(path_, model_, material, {.body = "bell", .material = "metal"}, false);
  }

  absl::StatusOr<GltfModel> Read(const std::string& pick = "",
                                 const v1::Material& given = {}) const {
    return ReadGltfModel(path_, pick, given);
  }

  /// What becomes of a good file in which `change` changes something.
  absl::StatusOr<GltfModel> TryChanged(const std::function<void(json&)>& change,
                                       const std::string& pick, const v1::Material& given) const {
    EXPECT_TRUE(Write().ok());
    json file = json::parse(ReadBytes(path_));
    change(file);
    WriteBytes(path_, file.dump());
    return Read(pick, given);
  }

  GltfModel ReadChanged(const std::function<void(json&)>& change, const std::string& pick = "",
                        const v1::Material& given = {}) const {
    return TryChanged(change, pick, given).value();
  }

  std::string Refused(const std::function<void(json&)>& change,
                      const std::string& pick = "") const {
    return TryChanged(change, pick, {}).status().ToString();
  }

  static json& Extension(json& file) { return file["extensions"]["KHR_audio_rigid_bodies"]; }
  static json& Model(json& file) { return Extension(file)["modalModels"][0]; }
  static json& Accessor(json& file, const char* name) {
    return file["accessors"][Model(file)[name].get<size_t>()];
  }

  const StoredModel model_ = SmallModel();
  const std::string path_ =
      TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".gltf";
};

TEST_F(GltfModelTest, WhatIsWrittenIsReadBackInSinglePrecision) {
  for (const bool binary : {false, true}) {
    ASSERT_TRUE(
        WriteGltfModel(path_, model_, SmallMaterial(), {.body = "bell", .material = ""}, binary)
            .ok());
    const GltfModel read = Read().value();
    EXPECT_EQ(read.label, "bell");
    const StoredModel& model = read.model;
    EXPECT_TRUE(MessageDifferencer::Equals(read.material, SmallMaterial()));
    EXPECT_TRUE(MessageDifferencer::Equals(model.header, model_.header));
    ExpectNear(model.eigenvalues, model_.eigenvalues);
    ExpectNear(model.shapes, model_.shapes);
    for (size_t m = 0; m < 3; ++m) {
      EXPECT_NEAR(model.couplings[m] / model_.couplings[m], 1, 1e-6) << m;
    }
    ExpectSameSurface(model, model_);
  }
}

TEST_F(GltfModelTest, WithoutIndicesTheMeshMovesAsTheNearestSamplePoints) {
  const GltfModel read = ReadChanged([](json& file) {
    Model(file).erase("indices");
    Model(file).erase("extras");
  });
  EXPECT_EQ(read.model.vertices, model_.given_vertices);
  EXPECT_EQ(read.model.triangles, model_.given_triangles);
  const std::vector<float> four(read.model.shapes.begin(), read.model.shapes.begin() + 36);
  ExpectNear(four, model_.shapes);
}

TEST_F(GltfModelTest, TheScaleOfTheNodeAndItsParentsIsTheSize) {
  const GltfModel read = ReadChanged([](json& file) {
    file["nodes"][0]["scale"] = {0.5, 0.5, 0.5};
    file["nodes"][0]["rotation"] = {0, 0.6, 0, 0.8};
    file["nodes"].push_back(
        {{"children", {0}}, {"matrix", {0, 4, 0, 0, -4, 0, 0, 0, 0, 0, 4, 0, 1, 2, 3, 1}}});
  });
  EXPECT_NEAR(read.model.vertices[3], 2, 1e-6);
  EXPECT_NEAR(read.model.given_vertices[12], 1, 1e-6);
  // What sounds, sounds at the size it has: frequencies stay.
  ExpectNear(read.model.eigenvalues, model_.eigenvalues);
}

void AddSecondModel(json& file) {
  json& models = file["extensions"]["KHR_audio_rigid_bodies"]["modalModels"];
  models.push_back(models[0]);
  models[1]["name"] = "second";
  file["nodes"].push_back({{"name", "large"},
                           {"scale", {2, 2, 2}},
                           {"extensions", {{"KHR_audio_rigid_bodies", {{"modalModel", 0}}}}}});
}

TEST_F(GltfModelTest, OfSeveralModelsOneIsPicked) {
  EXPECT_THAT(Refused(AddSecondModel), HasSubstr("MODEL_FILE_AMBIGUOUS: "));
  EXPECT_THAT(Refused(AddSecondModel, "third"), HasSubstr("0: bell, 1: second"));
  EXPECT_THAT(Refused(AddSecondModel, "2"), HasSubstr("MODEL_FILE_AMBIGUOUS: "));
  EXPECT_EQ(ReadChanged(AddSecondModel, "second").label, "second");
  EXPECT_EQ(ReadChanged(AddSecondModel, "1").label, "second");
  // Two nodes of different size sound with the first; its own name is that of one of them too.
  EXPECT_THAT(Refused(AddSecondModel, "0"), HasSubstr("different scale"));
  EXPECT_EQ(ReadChanged(AddSecondModel, "large").model.vertices[3], 2);
}

TEST_F(GltfModelTest, AMaterialThatTheFileLacksMustBeGiven) {
  const auto forget = [](json& file) { Model(file).erase("material"); };
  EXPECT_THAT(Refused(forget), HasSubstr("MODEL_FILE_MALFORMED: "));
  const GltfModel read = ReadChanged(forget, "", SmallMaterial());
  ExpectNear(read.model.eigenvalues, model_.eigenvalues);
}

TEST_F(GltfModelTest, DampingIsFittedToTheDecayRates) {
  const GltfModel read = ReadChanged([](json& file) {
    Extension(file)["acousticMaterials"][0].erase("alpha");
    Extension(file)["acousticMaterials"][0].erase("beta");
  });
  EXPECT_NEAR(read.material.alpha1_s(), 1e-7, 1e-12);
  EXPECT_NEAR(read.material.alpha2_per_s(), 3, 1e-4);
  EXPECT_EQ(read.model.header.warnings_size(), 1);
}

TEST_F(GltfModelTest, DampingByALossFactorComesBackAsTheSameDecayRates) {
  v1::Material material = SmallMaterial();
  for (const auto& [hz, eta] : {std::pair{100.0, 0.02}, std::pair{2000.0, 0.001}}) {
    v1::LossFactorPoint& point = *material.add_loss_factor();
    point.set_frequency_hz(hz);
    point.set_loss_factor(eta);
  }
  ASSERT_TRUE(Write(material).ok());
  json file = json::parse(ReadBytes(path_));
  EXPECT_FALSE(Extension(file)["acousticMaterials"][0].contains("alpha"));
  const GltfModel read = Read().value();
  for (const double eigenvalue : model_.eigenvalues) {
    const double hz = std::sqrt(eigenvalue * 7e10 / 2700) / (2 * std::numbers::pi);
    EXPECT_NEAR(DecayRatePerS(read.material, hz) / DecayRatePerS(material, hz), 1, 1e-6) << hz;
  }
  EXPECT_EQ(read.model.header.warnings_size(), 1);
}

TEST_F(GltfModelTest, OverdampedModesAreLeftOutAndSaidToBe) {
  v1::Material material = SmallMaterial();
  // Critical damping lies between the first eigenvalue and the second.
  material.set_alpha2_per_s(2 * std::sqrt(1.0 * 7e10 / 2700));
  material.set_alpha1_s(0);
  ASSERT_TRUE(Write(material).ok());
  const GltfModel read = Read().value();
  EXPECT_EQ(read.model.mode_count(), 2);
  EXPECT_LT(read.model.header.complete_to_eigenvalue(), model_.eigenvalues[0]);
  EXPECT_THAT(read.model.header.warnings(1), HasSubstr("left out 1 modes"));
  material.set_alpha2_per_s(1e9);
  EXPECT_THAT(Write(material).ToString(), HasSubstr("NO_MODE_IN_BAND: "));
}

TEST_F(GltfModelTest, WrongCountsSizesIndicesTypesAndNodesAreRefused) {
  const std::vector<std::function<void(json&)>> changes = {
      [](json& file) {
        Model(file).erase("indices");
        file["nodes"][0].erase("mesh");
      },
      // Neither an uneven scale nor one of two numbers; nor a node that is its own child.
      [](json& file) {
        file["nodes"][0]["scale"] = json::array({1, 1, 2});
      },
      [](json& file) {
        file["nodes"][0]["scale"] = json::array({1, 1});
      },
      [](json& file) { file["nodes"][0]["children"] = json::array({0}); },
      [](json& file) { Model(file)["shapes"] = 99; },
      [](json& file) { Model(file)["shapes"] = -1; },
      [](json& file) { Model(file)["shapes"] = "shapes"; },
      [](json& file) { Model(file).erase("frequencies"); },
      [](json& file) { Model(file)["material"] = 1; },
      [](json& file) { Model(file)["decayRates"] = Model(file)["indices"]; },
      [](json& file) { Model(file)["positions"] = Model(file)["frequencies"]; },
      [](json& file) { Model(file)["indices"] = Model(file)["frequencies"]; },
      [](json& file) { Accessor(file, "shapes")["count"] = 11; },
      [](json& file) { Accessor(file, "shapes")["count"] = 13; },
      [](json& file) { Accessor(file, "shapes")["count"] = UINT64_MAX / 12 + 2; },
      [](json& file) { Accessor(file, "shapes")["count"] = 1e300; },
      [](json& file) { Accessor(file, "shapes")["count"] = 0; },
      [](json& file) { Accessor(file, "decayRates")["count"] = 2; },
      [](json& file) { Accessor(file, "positions")["count"] = 3; },
      [](json& file) { Accessor(file, "indices")["count"] = 11; },
      [](json& file) { Accessor(file, "shapes")["byteOffset"] = UINT64_MAX; },
      [](json& file) { Accessor(file, "shapes")["componentType"] = 5130; },
      [](json& file) { Accessor(file, "shapes").erase("bufferView"); },
      [](json& file) { Accessor(file, "shapes")["sparse"] = json::object(); },
      [](json& file) { file["bufferViews"][3]["byteLength"] = UINT64_MAX; },
      [](json& file) { file["bufferViews"][3]["byteOffset"] = UINT64_MAX - 4; },
      [](json& file) { file["bufferViews"][3]["byteStride"] = 4; },
      [](json& file) { file["bufferViews"][3]["byteStride"] = UINT64_MAX; },
      [](json& file) { file["bufferViews"][3]["buffer"] = 1; },
      [](json& file) { file["bufferViews"] = nullptr; },
      [](json& file) { file["buffers"][0].erase("uri"); },
      [](json& file) { file["buffers"][0]["uri"] = "data:application/octet-stream;base64,??"; },
      [](json& file) { file["buffers"][0]["uri"] = "../../../etc/passwd"; },
      [](json& file) { file["buffers"][0]["uri"] = "%2e%2e/secret"; },
      [](json& file) { file["buffers"][0]["uri"] = "/etc/passwd"; },
      [](json& file) { file["buffers"][0]["uri"] = "file:///etc/passwd"; },
      [](json& file) {
        file["nodes"][0]["extensions"]["KHR_audio_rigid_bodies"]["modalModel"] = 0;
        Extension(file)["acousticMaterials"][0]["density"] = -1;
      },
      [](json& file) { file["asset"]["version"] = "1.0"; }};
  for (size_t i = 0; i < changes.size(); ++i) {
    EXPECT_THAT(Refused(changes[i]), HasSubstr("MODEL_FILE_MALFORMED: ")) << i;
  }
}

TEST_F(GltfModelTest, ABufferMayBeAFileBesideIt) {
  const GltfModel read = ReadChanged([&](json& file) {
    const std::string uri = file["buffers"][0]["uri"];
    std::string bytes;
    ASSERT_TRUE(absl::Base64Unescape(uri.substr(uri.find(',') + 1), &bytes));
    WriteBytes(TempDir() + "a buffer.bin", bytes);
    file["buffers"][0]["uri"] = "a%20buffer.bin";
  });
  ExpectNear(read.model.shapes, model_.shapes);
}

TEST_F(GltfModelTest, AFileCutShortAnywhereIsRefused) {
  for (const bool binary : {false, true}) {
    EXPECT_TRUE(WriteGltfModel(path_, model_, SmallMaterial(), {}, binary).ok());
    const std::string whole = ReadBytes(path_);
    for (size_t size = 0; size + 1 < whole.size(); size += 7) {
      WriteBytes(path_, whole.substr(0, size));
      EXPECT_THAT(Read().status().ToString(), HasSubstr("MODEL_FILE_MALFORMED: ")) << size;
    }
  }
}

TEST_F(GltfModelTest, WhateverBytesChangeTheReaderLives) {
  std::mt19937 random(1);
  for (const bool binary : {false, true}) {
    EXPECT_TRUE(WriteGltfModel(path_, model_, SmallMaterial(), {}, binary).ok());
    const std::string whole = ReadBytes(path_);
    for (int i = 0; i < 500; ++i) {
      std::string changed = whole;
      for (int k = 0; k < 3; ++k) {
        changed[random() % changed.size()] = static_cast<char>(random() % 256);
      }
      WriteBytes(path_, changed);
      const auto read = Read();
      EXPECT_TRUE(!read.ok() || Validate(read->model).ok()) << i;
    }
  }
}

constexpr double kOmegaPerHz = 2 * std::numbers::pi;

std::vector<DampedMode> RayleighModes(double alpha1_s, double alpha2_per_s) {
  std::vector<DampedMode> modes;
  for (const double hz : {150.0, 500.0, 1500.0, 8000.0}) {
    const double omega = kOmegaPerHz * hz;
    modes.push_back({hz, (alpha1_s * omega * omega + alpha2_per_s) / 2});
  }
  return modes;
}

v1::Material Fitted(const std::vector<DampedMode>& modes, v1::Material material = {}) {
  material.set_young_pa(1);
  material.set_density_kg_per_m3(1);
  FitDamping(modes, material);
  EXPECT_TRUE(ResolveMaterial(material).ok()) << ResolveMaterial(material).status();
  return material;
}

TEST(Damping, ThatOfAMaterialIsFoundInItsDecayRates) {
  for (const auto& [alpha1_s, alpha2_per_s] :
       {std::pair{1e-7, 30.0}, std::pair{1e-7, 0.0}, std::pair{0.0, 30.0}}) {
    const v1::Material found = Fitted(RayleighModes(alpha1_s, alpha2_per_s));
    EXPECT_NEAR(found.alpha1_s(), alpha1_s, 1e-16);
    EXPECT_NEAR(found.alpha2_per_s(), alpha2_per_s, 1e-8);
    EXPECT_EQ(found.loss_factor_size(), 0);
  }
}

TEST(Damping, WhatTheMaterialHasIsKeptWhereItFits) {
  v1::Material given;
  given.set_alpha1_s(1.001e-7);
  given.set_alpha2_per_s(30);
  EXPECT_EQ(Fitted(RayleighModes(1e-7, 30), given).alpha1_s(), 1.001e-7);
  given.set_alpha1_s(1.2e-7);
  EXPECT_NEAR(Fitted(RayleighModes(1e-7, 30), given).alpha1_s(), 1e-7, 1e-16);
}

TEST(Damping, DecayRatesOfAnyKindBecomeLossFactors) {
  // Two of one frequency with their mean; one that does not decay at all.
  const std::vector<DampedMode> modes = {{3000, 7}, {200, 40}, {1000, 0}, {400, 1}, {400, 1}};
  const v1::Material found = Fitted(modes);
  EXPECT_EQ(found.loss_factor_size(), 4);
  EXPECT_EQ(DampingError(modes, found), 0);
  EXPECT_NEAR(DecayRatePerS(found, 200), 40, 1e-9);
}

TEST(Damping, ModesBeyondThePointsOfAMaterialAreFittedBetween) {
  // A loss factor that rises smoothly: what lies between two of 256 points is near their line.
  std::vector<DampedMode> modes;
  for (int i = 0; i < 2000; ++i) {
    const double hz = 50 + 9.5 * i;
    modes.push_back({hz, 1e-3 * std::pow(hz / 50, 0.3) * kOmegaPerHz * hz / 2});
  }
  const v1::Material found = Fitted(modes);
  EXPECT_EQ(found.loss_factor_size(), 256);
  EXPECT_LT(DampingError(modes, found), kSameDamping);
  EXPECT_EQ(found.loss_factor(0).frequency_hz(), 50);
  EXPECT_EQ(found.loss_factor(255).frequency_hz(), modes.back().natural_hz);
}

}  // namespace
}  // namespace carillon::interchange
