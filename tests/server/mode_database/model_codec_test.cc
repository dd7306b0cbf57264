// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/model_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <ostream>

#include "server/base/xxh3.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;
using Records = std::vector<v1::ModalModelRecord>;

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
  const absl::StatusOr<ModalModel> read = ReadModelFile(folder / "model", "name");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->digest, "name");
  EXPECT_EQ(read->poisson_ratio, model.poisson_ratio);
  EXPECT_EQ(read->complete_to_eigenvalue, model.complete_to_eigenvalue);
  EXPECT_EQ(read->eigenvalues, model.eigenvalues);
  EXPECT_EQ(read->couplings, model.couplings);
  EXPECT_EQ(read->vertices, model.vertices);
  EXPECT_EQ(read->triangles, model.triangles);
  EXPECT_EQ(read->given_triangle, model.given_triangle);
  EXPECT_EQ(read->given_vertices, model.given_vertices);
  EXPECT_EQ(read->given_triangles, model.given_triangles);
  EXPECT_EQ(read->shapes, model.shapes);
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
}

TEST(ModelCodec, RefusesAFileThatIsNoModelAtAll) {
  const TemporaryFolder folder;
  WriteBytes(folder / "text", "solid cube\nfacet normal 0 0 1\n");
  EXPECT_THAT(ReadModelFile(folder / "text", "name").status().ToString(),
              HasSubstr("MODAL_MODEL_MALFORMED"));
  EXPECT_THAT(ReadModelFile(folder / "missing", "name").status().ToString(),
              HasSubstr("FILE_NOT_FOUND"));
}

struct Damage {
  const char* name;
  const char* reason;
  std::function<void(Records&)> inflict;
};

void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }

class ModelCheckerRefuses : public ::testing::TestWithParam<Damage> {};

// Records of the sample: header, then one chunk for each of the nine arrays in order.
TEST_P(ModelCheckerRefuses, TheDamage) {
  Records records = SampleRecords(SampleModel(3, 4));
  ASSERT_EQ(records.size(), 10U);
  ASSERT_TRUE(CheckAll(records).ok());
  GetParam().inflict(records);
  EXPECT_THAT(CheckAll(records).ToString(), HasSubstr(GetParam().reason));
}

constexpr char kMalformed[] = "MODAL_MODEL_MALFORMED";
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    All, ModelCheckerRefuses,
    ::testing::Values(
        Damage{"FlippedBit", "MODAL_MODEL_CORRUPT",
               [](Records& r) { (*r[9].mutable_chunk()->mutable_data())[5] ^= 4; }},
        Damage{"MissingLastChunk", kMalformed, [](Records& r) { r.pop_back(); }},
        Damage{"MissingMiddleChunk", kMalformed, [](Records& r) { r.erase(r.begin() + 4); }},
        Damage{"RepeatedChunk", kMalformed, [](Records& r) { r.push_back(r.back()); }},
        Damage{"SecondHeader", kMalformed, [](Records& r) { r.push_back(r.front()); }},
        Damage{"NoHeader", kMalformed, [](Records& r) { r.erase(r.begin()); }},
        Damage{"EmptyRecord", kMalformed, [](Records& r) { r.emplace_back(); }},
        Damage{"NewerFormat", kMalformed,
               [](Records& r) { r[0].mutable_header()->set_format_version(2); }},
        Damage{"MissingArray", kMalformed,
               [](Records& r) {
                 r[0].mutable_header()->mutable_arrays()->RemoveLast();
                 r.pop_back();
               }},
        Damage{"ShapeOfOtherModeCount", kMalformed,
               [](Records& r) { r[0].mutable_header()->mutable_arrays(8)->set_shape(2, 2); }},
        Damage{"ModeCountOfOtherShape", kMalformed,
               [](Records& r) { r[0].mutable_header()->set_mode_count(4); }},
        Damage{"ShapeBeyondAllMemory", kMalformed,
               [](Records& r) {
                 r[0].mutable_header()->mutable_arrays(8)->set_shape(0, 1ULL << 62U);
               }},
        Damage{"WrongType", kMalformed,
               [](Records& r) {
                 r[0].mutable_header()->mutable_arrays(0)->set_type(v1::ELEMENT_TYPE_UINT32);
               }},
        Damage{"NanEigenvalue", kMalformed, [](Records& r) { Poke(r[1], 1, kNan); }},
        Damage{"DescendingEigenvalues", kMalformed, [](Records& r) { Poke(r[1], 2, 1.0); }},
        Damage{"ZeroEigenvalue", kMalformed, [](Records& r) { Poke(r[1], 0, 0.0); }},
        Damage{"InfiniteShape", kMalformed,
               [](Records& r) { Poke(r[9], 7, std::numeric_limits<float>::infinity()); }},
        Damage{"AllVerticesEqual", kMalformed,
               [](Records& r) {
                 for (size_t i = 0; i < 12; ++i) Poke(r[4], i, 1.5F + static_cast<float>(i % 3));
               }},
        Damage{"VertexOutOfRange", kMalformed, [](Records& r) { Poke(r[5], 3, uint32_t{4}); }},
        Damage{"GivenTriangleOutOfRange", kMalformed,
               [](Records& r) { Poke(r[6], 0, uint32_t{4}); }},
        Damage{"GivenVertexOutOfRange", kMalformed,
               [](Records& r) { Poke(r[8], 11, uint32_t{77}); }},
        Damage{
            "PoissonOutOfRange", kMalformed,
            [](Records& r) { r[0].mutable_header()->mutable_settings()->set_poisson_ratio(0.5); }}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace carillon
