// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/reason_catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

using testing::HasSubstr;

TEST(ReasonCatalogue, HasEveryRowWithItsCellsInWhichALinkIsTheNameOfItsPage) {
  EXPECT_GT(Reasons().size(), 100U);
  for (const CatalogueReason& reason : Reasons()) {
    EXPECT_FALSE(reason.meaning.empty()) << reason.name;
    EXPECT_FALSE(reason.repair.empty()) << reason.name;
    EXPECT_EQ((reason.meaning + reason.repair).find("]("), std::string::npos) << reason.name;
  }
  EXPECT_TRUE(std::ranges::any_of(Reasons(), [](const CatalogueReason& reason) {
    return reason.name == "CONTACTS_LATE" && reason.code.empty();
  }));
  EXPECT_THAT(FindReason("WORK_LEFT_OUT")->repair,
              HasSubstr("'what is left out' in docs/rendering.md"));
}

TEST(ReasonCatalogue, IsFoundByNameInAnyLettersAndByAWholeMessage) {
  for (const char* text : {"MESH_NOT_CLOSED", "mesh_not_closed", "MESH_NOT_CLOSED: 3 edges"}) {
    const auto reason = *FindReason(text);
    EXPECT_EQ(reason.name, "MESH_NOT_CLOSED");
    EXPECT_EQ(reason.code, "INVALID_ARGUMENT");
  }
}

TEST(ReasonCatalogue, ANameThatIsNotThereHasItsNearest) {
  EXPECT_THAT(FindReason("MESH_NOT_CLOSD").status().ToString(),
              HasSubstr("INVALID_SETTINGS: there is no reason MESH_NOT_CLOSD; did you mean "
                        "MESH_NOT_CLOSED?"));
  EXPECT_THAT(FindReason("closed_mesh").status().ToString(),
              HasSubstr("did you mean MESH_NOT_CLOSED?"));
  EXPECT_THAT(FindReason("qqqqqqqqqqqq").status().ToString(), HasSubstr("lists all"));
}

TEST(ErrorReason, FiguresAndRemediesInTheirOrderSurviveTheWayThroughErrorInfo) {
  absl::Status status = Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
                                "the first mode is at 31000 Hz: choose a softer material");
  AddFigure(status, "first_mode_hz", "31000");
  v1::Remedy repair;
  repair.set_field("settings.mesh.repair");
  repair.set_value("true");
  repair.set_option("--repair");
  repair.set_effect("repairs it");
  v1::Remedy band;
  band.set_option("--band");
  band.set_effect("widens it");
  AddRemedy(status, repair);
  AddRemedy(status, band);
  const v1::ErrorInfo error = ToErrorInfo(status);
  EXPECT_EQ(error.reason(), "NO_MODE_IN_BAND");
  EXPECT_EQ(error.message(), "the first mode is at 31000 Hz: choose a softer material");
  EXPECT_EQ(error.metadata().at("first_mode_hz"), "31000");
  ASSERT_EQ(error.remedies_size(), 2);
  EXPECT_EQ(error.remedies(0).field(), "settings.mesh.repair");
  EXPECT_EQ(RemedyText(error.remedies(0)), "--repair: repairs it");
  EXPECT_EQ(RemedyText(error.remedies(1)), "--band: widens it");
  EXPECT_EQ(FromErrorInfo(status.code(), error), status);
}

TEST(ErrorReason, AMessageWithoutReasonIsInternal) {
  const v1::ErrorInfo error = ToErrorInfo(absl::InternalError("disk: on fire"));
  EXPECT_EQ(error.reason(), "INTERNAL");
  EXPECT_EQ(error.message(), "disk: on fire");
}

}  // namespace
}  // namespace carillon
