// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/model_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "server/base/xxh3.h"
#include "server/mode_database/codec/imported_figures.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;
using Records = std::vector<v1::ModalModelRecord>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

absl::Status CheckAll(const Records& records) {
  ModelChecker checker;
  for (const v1::ModalModelRecord& record : records) {
    absl::Status status = checker.Check(record);
    if (!status.ok()) return status;
  }
  return checker.Finish();
}

template <typename T>
void Poke(v1::ModalModelRecord& record, size_t index, T value) {
  std::memcpy(record.mutable_chunk()->mutable_data()->data() + index * sizeof value, &value,
              sizeof value);
  record.mutable_chunk()->set_xxh3(Xxh3(record.chunk().data()));
}

TEST(ModelCodec, GivesBackEveryNumberOfAModelOfSeveralChunks) {
  const TemporaryFolder folder;
  const ModalModel model = SampleModel(100, 1000);
  ASSERT_GT(model.shapes.size() * sizeof(float), 1U << 20U);
  WriteRecords(folder / "model", SampleRecords(model));
  const ModalModel read = *ReadModelFile(folder / "model", "name");
  EXPECT_EQ(read.digest, "name");
  EXPECT_EQ(read.poisson_ratio, model.poisson_ratio);
  EXPECT_EQ(read.complete_to_eigenvalue, model.complete_to_eigenvalue);
  EXPECT_EQ(read.eigenvalues, model.eigenvalues);
  EXPECT_EQ(read.couplings, model.couplings);
  EXPECT_EQ(read.vertices, model.vertices);
  EXPECT_EQ(read.triangles, model.triangles);
  EXPECT_EQ(read.given_triangle, model.given_triangle);
  EXPECT_EQ(read.given_vertices, model.given_vertices);
  EXPECT_EQ(read.given_triangles, model.given_triangles);
  EXPECT_EQ(read.shapes, model.shapes);
}

TEST(ModelCodec, RefusesAFileCutShortAtAnyByte) {
  const TemporaryFolder folder;
  WriteRecords(folder / "whole", SampleRecords(SampleModel(2, 4)));
  const std::string bytes = ReadBytes(folder / "whole");
  for (size_t size = 0; size < bytes.size(); ++size) {
    WriteBytes(folder / "cut", bytes.substr(0, size));
    EXPECT_THAT(ReadModelFile(folder / "cut", "name").status().ToString(),
                HasSubstr("MODAL_MODEL_MALFORMED"))
        << size;
  }
  EXPECT_THAT(ReadModelFile(folder / "missing", "name").status().ToString(),
              HasSubstr("FILE_NOT_FOUND"));
}

// Records of the sample: header, then one chunk for each of the nine arrays in order.
TEST(ModelChecker, RefusesEveryDamage) {
  const Records whole = SampleRecords(SampleModel(3, 4));
  ASSERT_EQ(whole.size(), 10U);
  ASSERT_TRUE(CheckAll(whole).ok());
  const std::vector<std::pair<std::string, std::function<void(Records&)>>> damages = {
      {"FlippedBit", [](Records& r) { (*r[9].mutable_chunk()->mutable_data())[5] ^= 4; }},
      {"MissingLastChunk", [](Records& r) { r.pop_back(); }},
      {"MissingMiddleChunk", [](Records& r) { r.erase(r.begin() + 4); }},
      {"RepeatedChunk", [](Records& r) { r.push_back(r.back()); }},
      {"SecondHeader", [](Records& r) { r.push_back(r.front()); }},
      {"NoHeader", [](Records& r) { r.erase(r.begin()); }},
      {"EmptyRecord", [](Records& r) { r.emplace_back(); }},
      {"NewerFormat", [](Records& r) { r[0].mutable_header()->set_format_version(2); }},
      {"MissingArray",
       [](Records& r) {
         r[0].mutable_header()->mutable_arrays()->RemoveLast();
         r.pop_back();
       }},
      {"ShapeOfOtherModeCount",
       [](Records& r) { r[0].mutable_header()->mutable_arrays(8)->set_shape(2, 2); }},
      {"ModeCountOfOtherShape", [](Records& r) { r[0].mutable_header()->set_mode_count(4); }},
      {"ShapeBeyondAllMemory",
       [](Records& r) { r[0].mutable_header()->mutable_arrays(8)->set_shape(0, 1ULL << 62U); }},
      {"WrongType",
       [](Records& r) {
         r[0].mutable_header()->mutable_arrays(0)->set_type(v1::ELEMENT_TYPE_UINT32);
       }},
      {"NanEigenvalue", [](Records& r) { Poke(r[1], 1, kNan); }},
      {"DescendingEigenvalues", [](Records& r) { Poke(r[1], 2, 1.0); }},
      {"ZeroEigenvalue", [](Records& r) { Poke(r[1], 0, 0.0); }},
      {"InfiniteShape", [](Records& r) { Poke(r[9], 7, std::numeric_limits<float>::infinity()); }},
      {"AllVerticesEqual",
       [](Records& r) {
         for (size_t i = 0; i < 12; ++i) Poke(r[4], i, 1.5F + static_cast<float>(i % 3));
       }},
      {"VertexOutOfRange", [](Records& r) { Poke(r[5], 3, uint32_t{4}); }},
      {"GivenTriangleOutOfRange", [](Records& r) { Poke(r[6], 0, uint32_t{4}); }},
      {"GivenVertexOutOfRange", [](Records& r) { Poke(r[8], 11, uint32_t{77}); }},
      {"PoissonOutOfRange",
       [](Records& r) { r[0].mutable_header()->mutable_settings()->set_poisson_ratio(0.5); }}};
  for (const auto& [name, inflict] : damages) {
    Records records = whole;
    inflict(records);
    EXPECT_THAT(CheckAll(records).ToString(),
                HasSubstr(name == "FlippedBit" ? "MODAL_MODEL_CORRUPT" : "MODAL_MODEL_MALFORMED"))
        << name;
  }
}

using testing::AllOf;

v1::ModalModelHeader ModelHeader() {
  v1::ModalModelHeader header = SampleHeader(SampleModel(3, 4));
  header.set_mode_count(3);
  return header;
}

TEST(ImportedFigures, AModelWithKnownOrUnknownFiguresIsTaken) {
  v1::ModalModelHeader header = ModelHeader();
  EXPECT_TRUE(CheckFigures(header).ok());
  header.set_volume_m3(1e-3);
  header.set_mesh_digest(std::string(64, 'a'));
  for (const float error : {0.0F, 0.1F, 2.0F}) header.add_estimated_errors(error);
  for (const double slope : {-1.0, 0.0, 1.5}) header.add_poisson_slopes(slope);
  EXPECT_TRUE(CheckFigures(header).ok());
}

TEST(ImportedFigures, AModelWithAnImpossibleFigureIsRefusedAndTheFigureNamed) {
  const auto expect = [](const char* named,
                         const std::function<void(v1::ModalModelHeader&)>& change) {
    v1::ModalModelHeader header = ModelHeader();
    change(header);
    EXPECT_THAT(CheckFigures(header).ToString(),
                AllOf(HasSubstr("MODAL_MODEL_MALFORMED: "), HasSubstr(named)));
  };
  for (const double volume : {-1.0, kNan, kInfinity, 1e300}) {
    expect("volume_m3", [=](auto& header) { header.set_volume_m3(volume); });
  }
  for (const double figure : {-1.0, kNan, kInfinity}) {
    expect("complete_to_eigenvalue",
           [=](auto& header) { header.set_complete_to_eigenvalue(figure); });
    expect("estimated_errors", [=](auto& header) {
      for (int i = 0; i < 3; ++i) header.add_estimated_errors(static_cast<float>(figure));
    });
  }
  expect("number of estimated_errors in the header is 1",
         [](auto& header) { header.add_estimated_errors(0.1F); });
  expect("poisson_slopes", [](auto& header) {
    for (int i = 0; i < 3; ++i) header.add_poisson_slopes(kNan);
  });
  expect("number of poisson_slopes in the header is 1",
         [](auto& header) { header.add_poisson_slopes(0.1); });
  expect("mesh_digest", [](auto& header) { header.set_mesh_digest("../../etc/passwd"); });
}

}  // namespace
}  // namespace carillon
