// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/error_reason.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

TEST(ErrorReason, SurvivesTheWayThroughErrorInfo) {
  absl::Status status = Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
                                "the first mode is at 31000 Hz: choose a softer material");
  AddFigure(status, "first_mode_hz", "31000");
  const v1::ErrorInfo error = ToErrorInfo(status);
  EXPECT_EQ(error.reason(), "NO_MODE_IN_BAND");
  EXPECT_EQ(error.message(), "the first mode is at 31000 Hz: choose a softer material");
  EXPECT_EQ(error.metadata().at("first_mode_hz"), "31000");
  EXPECT_EQ(FromErrorInfo(status.code(), error), status);
}

TEST(ErrorReason, RemediesKeepTheirOrderThroughTheWire) {
  absl::Status status =
      Refusal(absl::StatusCode::kInvalidArgument, "MESH_NOT_CLOSED", "the surface has a hole");
  v1::Remedy repair;
  repair.set_field("settings.mesh.repair");
  repair.set_value("true");
  repair.set_option("--repair");
  repair.set_effect("repairs it");
  v1::Remedy wall;
  wall.set_option("--wall");
  wall.set_effect("thickens it");
  AddRemedy(status, repair);
  AddRemedy(status, wall);
  const v1::ErrorInfo error = ToErrorInfo(status);
  ASSERT_EQ(error.remedies_size(), 2);
  EXPECT_EQ(error.remedies(0).field(), "settings.mesh.repair");
  EXPECT_EQ(RemedyText(error.remedies(0)), "--repair: repairs it");
  EXPECT_EQ(RemedyText(error.remedies(1)), "--wall: thickens it");
  EXPECT_EQ(FromErrorInfo(status.code(), error), status);
}

TEST(ErrorReason, AMessageWithoutReasonIsInternal) {
  const v1::ErrorInfo error = ToErrorInfo(absl::InternalError("disk: on fire"));
  EXPECT_EQ(error.reason(), "INTERNAL");
  EXPECT_EQ(error.message(), "disk: on fire");
}

}  // namespace
}  // namespace carillon
