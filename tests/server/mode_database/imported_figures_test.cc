// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/imported_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "tests/server/mode_database/sample_model.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
  const auto refusal = [](const std::function<void(v1::ModalModelHeader&)>& change) {
    v1::ModalModelHeader header = ModelHeader();
    change(header);
    return CheckFigures(header).ToString();
  };
  const auto names = [](const char* what) {
    return AllOf(HasSubstr("MODAL_MODEL_MALFORMED: "), HasSubstr(what));
  };
  for (const double volume : {-1.0, kNan, kInfinity, 1e300}) {
    EXPECT_THAT(refusal([=](auto& header) { header.set_volume_m3(volume); }), names("volume_m3"));
  }
  for (const double eigenvalue : {-1.0, kNan, kInfinity}) {
    EXPECT_THAT(refusal([=](auto& header) { header.set_complete_to_eigenvalue(eigenvalue); }),
                names("complete_to_eigenvalue"));
  }
  for (const double error : {-0.1, kNan, kInfinity}) {
    EXPECT_THAT(refusal([=](auto& header) {
                  for (int i = 0; i < 3; ++i)
                    header.add_estimated_errors(static_cast<float>(error));
                }),
                names("estimated_errors"));
  }
  EXPECT_THAT(refusal([](auto& header) { header.add_estimated_errors(0.1F); }),
              names("number of estimated_errors in the header is 1"));
  EXPECT_THAT(refusal([](auto& header) {
                for (int i = 0; i < 3; ++i) header.add_poisson_slopes(kNan);
              }),
              names("poisson_slopes"));
  EXPECT_THAT(refusal([](auto& header) { header.add_poisson_slopes(0.1); }),
              names("number of poisson_slopes in the header is 1"));
  EXPECT_THAT(refusal([](auto& header) { header.set_mesh_digest("../../etc/passwd"); }),
              names("mesh_digest"));
}

}  // namespace
}  // namespace carillon
