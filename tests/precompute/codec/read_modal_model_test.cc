// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/codec/read_modal_model.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace carillon::precompute {
namespace {

// Arrays of more than a mebibyte are stored in several chunks, of which only the first has the
// offset zero.
TEST(ReadModalModel, ReadsModelsWhoseArraysHaveSeveralChunks) {
  constexpr size_t kTriangles = 200000;
  ModalModel model;
  model.eigenvalues = {4};
  model.residuals = {0};
  model.couplings = {1};
  model.estimated_errors = {0};
  model.vertices.assign(4, {1, 2, 3});
  for (size_t t = 0; t < kTriangles; ++t) {
    model.triangles.push_back({static_cast<int32_t>(t % 4), 1, 2});
  }
  model.given_triangle.assign(kTriangles, 0);
  model.given.vertices.assign(3, {0, 0, 0});
  model.given.triangles = {{0, 1, 2}};
  model.shapes.assign(12, 0.5F);
  const std::string path = testing::TempDir() + "several_chunks.model";
  ASSERT_TRUE(WriteModalModel(path, model, {}).ok());
  const auto stored = ReadModalModel(path);
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->model.triangles, model.triangles);
  EXPECT_EQ(stored->model.vertices, model.vertices);
  EXPECT_EQ(stored->model.shapes, model.shapes);
}

}  // namespace
}  // namespace carillon::precompute
