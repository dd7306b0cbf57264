// SPDX-License-Identifier: AGPL-3.0-or-later
//
// What is written of a model is what is read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "precompute/codec/modal_model_codec.h"
#include "precompute/codec/read_modal_model.h"

namespace carillon::precompute {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

/// A model of three modes on a tetrahedron, in which no two figures are the same.
ModalModel SmallModel() {
  ModalModel model;
  model.node_count = 11;
  model.element_count = 12;
  model.volume_m3 = 0.13;
  model.complete_to_eigenvalue = 1e9 / 3;
  model.lowered_from_mode_count = 14;
  model.left_out_mode_count = 15;
  model.warnings = {"one", "two \"quoted\""};
  model.eigenvalues = {1.0 / 3, 1e7 / 7, 1e8 / 3};
  model.residuals = {1e-9, 2e-9, 3e-9};
  model.couplings = {-0.1, 0.2, 1e-300};
  model.estimated_errors = {0.01, 0.02, 0.5};
  model.poisson_slopes = {-0.1, 1.0 / 3, 1.2};
  model.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.1F}};
  model.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  model.given_triangle = {3, 2, 1, 0};
  model.given.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.1}};
  model.given.triangles = {{2, 0, 3}, {1, 2, 3}, {0, 1, 3}, {0, 2, 1}};
  for (int i = 0; i < 4 * 3 * 3; ++i) model.shapes.push_back(static_cast<float>(i) / 7);
  return model;
}

struct RoundTripTest : ::testing::Test {
  ~RoundTripTest() override { std::filesystem::remove(path); }

  std::string ReadBytes() const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  // The tests of a program run side by side.
  const std::string path =
      testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".model";
};

TEST_F(RoundTripTest, KeepsEveryFigureOfAModelAndItsOrigin) {
  const ModalModel model = SmallModel();
  ModelOrigin origin{.mesh_digest = "4f", .settings = {}};
  origin.settings.set_poisson_ratio(0.33);
  origin.settings.mutable_mesh()->set_wall_m(0.003);
  ASSERT_TRUE(WriteModalModel(path, model, origin).ok());
  const auto stored = ReadModalModel(path).value();
  const ModalModel& read = stored.model;
  EXPECT_EQ(read.node_count, model.node_count);
  EXPECT_EQ(read.element_count, model.element_count);
  EXPECT_EQ(read.volume_m3, model.volume_m3);
  EXPECT_EQ(read.complete_to_eigenvalue, model.complete_to_eigenvalue);
  EXPECT_EQ(read.lowered_from_mode_count, model.lowered_from_mode_count);
  EXPECT_EQ(read.left_out_mode_count, model.left_out_mode_count);
  EXPECT_EQ(read.warnings, model.warnings);
  EXPECT_EQ(read.eigenvalues, model.eigenvalues);
  EXPECT_EQ(read.residuals, model.residuals);
  EXPECT_EQ(read.couplings, model.couplings);
  EXPECT_EQ(read.vertices, model.vertices);
  EXPECT_EQ(read.triangles, model.triangles);
  EXPECT_EQ(read.shapes, model.shapes);
  for (size_t m = 0; m < 3; ++m) {
    EXPECT_EQ(read.estimated_errors[m], static_cast<float>(model.estimated_errors[m]));
  }
  EXPECT_EQ(read.poisson_slopes, model.poisson_slopes);
  EXPECT_EQ(stored.origin.mesh_digest, "4f");
  EXPECT_EQ(stored.origin.settings.SerializeAsString(), origin.settings.SerializeAsString());
}

// Arrays of more than a mebibyte are stored in several chunks, of which only the first has the
// offset zero.
TEST_F(RoundTripTest, KeepsArraysOfSeveralChunks) {
  constexpr size_t kTriangles = 200'000;
  ModalModel model = SmallModel();
  model.triangles.clear();
  for (size_t t = 0; t < kTriangles; ++t) {
    model.triangles.push_back({static_cast<int32_t>(t % 4), 1, 2});
  }
  model.given_triangle.assign(kTriangles, 0);
  ASSERT_TRUE(WriteModalModel(path, model, {}).ok());
  const auto stored = ReadModalModel(path).value();
  EXPECT_EQ(stored.model.triangles, model.triangles);
  EXPECT_EQ(stored.model.vertices, model.vertices);
  EXPECT_EQ(stored.model.shapes, model.shapes);
}

TEST_F(RoundTripTest, WritesTheSameBytesAgain) {
  ASSERT_TRUE(WriteModalModel(path, SmallModel(), {}).ok());
  const std::string first = ReadBytes();
  ASSERT_TRUE(WriteModalModel(path, SmallModel(), {}).ok());
  EXPECT_EQ(ReadBytes(), first);
}

TEST_F(RoundTripTest, AFileThatEndsEarlyIsRefusedWhereverItEnds) {
  ASSERT_TRUE(WriteModalModel(path, SmallModel(), {}).ok());
  const std::string whole = ReadBytes();
  for (size_t size = 0; size < whole.size(); size += 7) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    EXPECT_THAT(ReadModalModel(path).status().ToString(),
                AnyOf(HasSubstr("MODAL_MODEL_MALFORMED"), HasSubstr("MODAL_MODEL_CORRUPT")))
        << size << " of " << whole.size() << " bytes";
  }
}

TEST_F(RoundTripTest, AnArrayWithAChangedBitIsRefused) {
  ASSERT_TRUE(WriteModalModel(path, SmallModel(), {}).ok());
  std::string bytes = ReadBytes();
  const float last = SmallModel().shapes.back();
  const std::string shape(reinterpret_cast<const char*>(&last), sizeof last);
  const size_t place = bytes.rfind(shape);
  ASSERT_NE(place, std::string::npos);
  bytes[place] ^= 1;
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_THAT(ReadModalModel(path).status().ToString(), HasSubstr("MODAL_MODEL_CORRUPT"));
}

}  // namespace
}  // namespace carillon::precompute
