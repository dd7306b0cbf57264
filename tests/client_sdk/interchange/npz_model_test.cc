// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/npz_model.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "client_sdk/interchange/complete_model.h"
#include "client_sdk/interchange/npy_array.h"
#include "client_sdk/interchange/zip_archive.h"
#include "tests/client_sdk/interchange/small_model.h"

namespace carillon::interchange {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::TempDir;

template <class T>
ZipEntry Entry(const std::string& name, const std::string& type, const std::vector<uint64_t>& shape,
               const std::vector<T>& numbers) {
  return {
      .name = name + ".npy",
      .head = NpyHeader(type, shape) + std::string(reinterpret_cast<const char*>(numbers.data()),
                                                   numbers.size() * sizeof(T)),
      .body = {}};
}

class NpzModel : public testing::Test {
 protected:
  /// The least that makes a model, with NumPy's usual types.
  std::vector<ZipEntry> Least() const {
    const std::vector<double> vertices(model_.vertices.begin(), model_.vertices.end());
    const std::vector<int64_t> triangles(model_.triangles.begin(), model_.triangles.end());
    return {Entry("eigenvalues", "<f8", {3}, model_.eigenvalues),
            Entry("vertices", "<f8", {4, 3}, vertices),
            Entry("triangles", "<i8", {4, 3}, triangles),
            Entry("shapes", "<f4", {4, 3, 3}, model_.shapes),
            Entry("poisson_ratio", "<f8", {}, std::vector<double>{0.3})};
  }

  absl::StatusOr<StoredModel> ReadBack(const std::vector<ZipEntry>& entries) const {
    EXPECT_TRUE(WriteZip(path_, entries).ok());
    return ReadNpz(path_);
  }

  std::string Refused(const std::vector<ZipEntry>& entries) const {
    return ReadBack(entries).status().ToString();
  }

  const StoredModel model_ = SmallModel();
  const std::string path_ =
      TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".npz";
};

TEST_F(NpzModel, WhatIsWrittenIsReadBackToTheBit) {
  ASSERT_TRUE(WriteNpz(path_, model_).ok());
  const StoredModel read = ReadNpz(path_).value();
  EXPECT_EQ(read.eigenvalues, model_.eigenvalues);
  EXPECT_EQ(read.residuals, model_.residuals);
  EXPECT_EQ(read.couplings, model_.couplings);
  ExpectSameSurface(read, model_);
  EXPECT_EQ(read.shapes, model_.shapes);
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(read.header, model_.header))
      << read.header.DebugString();
}

TEST_F(NpzModel, WhatAResearcherLeavesOutIsMade) {
  const StoredModel read = ReadBack(Least()).value();
  EXPECT_EQ(read.vertices, model_.vertices);
  EXPECT_EQ(read.triangles, model_.triangles);
  EXPECT_EQ(read.given_triangles, model_.triangles);
  EXPECT_THAT(read.given_triangle, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(read.couplings, model_.couplings);
  EXPECT_EQ(read.header.complete_to_eigenvalue(), model_.eigenvalues.back());
  EXPECT_DOUBLE_EQ(read.header.volume_m3(), 1.0 / 6);
  EXPECT_EQ(read.header.settings().poisson_ratio(), 0.3);
}

TEST_F(NpzModel, ArraysThatAreMissingOrWrongAreRefused) {
  for (const ptrdiff_t missing : {0, 1, 2, 3, 4}) {
    std::vector<ZipEntry> entries = Least();
    entries.erase(entries.begin() + missing);
    EXPECT_THAT(Refused(entries), HasSubstr("MODEL_FILE_MALFORMED: ")) << missing;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<size_t, ZipEntry>> wrong = {
      {0, Entry("eigenvalues", "<f8", {3}, std::vector<double>{1, nan, 3})},
      {0, Entry("eigenvalues", "<f8", {3}, std::vector<double>{3, 2, 1})},
      {0, Entry("eigenvalues", "<f8", {3}, std::vector<double>{0, 2, 3})},
      {0, Entry("eigenvalues", "<f8", {4}, std::vector<double>{1, 2, 3})},
      {0, Entry("eigenvalues", ">f8", {3}, std::vector<double>{1, 2, 3})},
      {0, Entry("eigenvalues", "<f8", {1ULL << 62, 8}, std::vector<double>{1, 2, 3})},
      {0, Entry("eigenvalues", "<f8", {0}, std::vector<double>{})},
      {1, Entry("vertices", "<f8", {3, 4}, std::vector<double>(12, 1.0))},
      {2, Entry("triangles", "<i8", {4, 3}, std::vector<int64_t>(12, 4))},
      {2, Entry("triangles", "<i8", {4, 3}, std::vector<int64_t>(12, -1))},
      {2, Entry("triangles", "<i8", {4, 3}, std::vector<int64_t>(12, int64_t{1} << 32))},
      {2, Entry("triangles", "<f8", {4, 3}, std::vector<double>(12, 1))},
      {3, Entry("shapes", "<f4", {4, 3, 4}, std::vector<float>(48, 1))},
      {3, Entry("shapes", "<f4", {3, 3, 3}, std::vector<float>(27, 1))},
      {4, Entry("poisson_ratio", "<f8", {}, std::vector<double>{0.5})},
      {4, Entry("poisson_ratio", "<f8", {2}, std::vector<double>{0.3, 0.3})}};
  for (const auto& [index, entry] : wrong) {
    std::vector<ZipEntry> entries = Least();
    entries[index] = entry;
    EXPECT_THAT(Refused(entries), HasSubstr("MODEL_FILE_MALFORMED: ")) << entry.head;
  }
}

TEST_F(NpzModel, AChangedByteIsFoundOrHarmless) {
  ASSERT_TRUE(WriteNpz(path_, model_).ok());
  const std::string whole = ReadBytes(path_);
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    std::string changed = whole;
    changed[random() % changed.size()] ^= static_cast<char>(1U << random() % 8);
    WriteBytes(path_, changed);
    const auto read = ReadNpz(path_);
    // The archive has a hash of each array: what is still read is what was written.
    EXPECT_TRUE(!read.ok() || read->shapes == model_.shapes) << i;
  }
}

TEST(NpyArray, ATextOfCharactersIsUtf8) {
  const std::vector<uint32_t> codes = {'a', 0xe9, 0x20ac, 0x1d11e, 0};
  NpyArray array{.type = "<U5", .shape = {}, .bytes = {}};
  array.bytes.assign(reinterpret_cast<const char*>(codes.data()), codes.size() * sizeof(uint32_t));
  EXPECT_EQ(*ToText("header", array), "a\xc3\xa9\xe2\x82\xac\xf0\x9d\x84\x9e");
}

/// A right triangle in the plane z = 0, legs of two and three, whose corners move by these along z.
StoredModel Triangle(float a, float b, float c) {
  StoredModel model;
  model.eigenvalues = {4};
  model.vertices = {0, 0, 0, 2, 0, 0, 0, 3, 0};
  model.triangles = {0, 1, 2};
  model.shapes = {9, 9, a, 9, 9, b, 9, 9, c};  // along the plane no air is moved
  return model;
}

double Coupling(float a, float b, float c) {
  StoredModel model = Triangle(a, b, c);
  EXPECT_TRUE(Complete(model).ok());
  return model.couplings.at(0);
}

/// Returns sqrt(4) times the integral of |f| over the triangle, summed over small cells. The zero
/// of f crosses some of these cells, which make an error of 1e-5.
double CouplingByCells(double a, double b, double c) {
  constexpr int kCells = 1000;
  double sum = 0;
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; i + j < kCells; ++j) {
      const double u = (i + 1.0 / 3) / kCells, v = (j + 1.0 / 3) / kCells;
      sum += std::abs(a + u * (b - a) + v * (c - a));
      if (i + j + 1 == kCells) continue;
      sum += std::abs(a + (u + 1.0 / 3 / kCells) * (b - a) + (v + 1.0 / 3 / kCells) * (c - a));
    }
  }
  return 2 * sum * 3 / (kCells * kCells);
}

TEST(CompleteModel, ACouplingIsTheIntegralOfWhatMovesAlongTheNormal) {
  EXPECT_DOUBLE_EQ(Coupling(1, 1, 1), 6);
  EXPECT_DOUBLE_EQ(Coupling(-1, -1, -1), 6);
  EXPECT_DOUBLE_EQ(Coupling(0, 3, 0), 6);
  for (const auto& [a, b, c] : {std::array{1.F, -1.F, 2.F}, std::array{-3.F, 1.F, 2.F},
                                std::array{0.F, 1.F, -1.F}, std::array{2.F, -1.F, -0.5F}}) {
    EXPECT_NEAR(Coupling(a, b, c), CouplingByCells(a, b, c), 1e-4) << a << b << c;
  }
}

TEST(CompleteModel, WhatIsLeftOutIsTheSoundingSurfaceItself) {
  StoredModel model = Triangle(1, 1, 1);
  model.header.mutable_verification()->set_max_residual(1e-9);
  model.header.add_estimated_errors(0.1F);
  model.header.add_estimated_errors(0.1F);
  ASSERT_TRUE(Complete(model).ok());
  EXPECT_EQ(model.given_triangles, model.triangles);
  EXPECT_EQ(model.given_vertices, model.vertices);
  EXPECT_EQ(model.residuals, std::vector{1e-9});
  EXPECT_EQ(model.header.complete_to_eigenvalue(), 4);
  EXPECT_EQ(model.header.estimated_errors_size(), 0) << "two, but there is one mode";
}

}  // namespace
}  // namespace carillon::interchange
