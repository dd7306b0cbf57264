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

TEST(ErrorReason, AMessageWithoutReasonIsInternal) {
  const v1::ErrorInfo error = ToErrorInfo(absl::InternalError("disk: on fire"));
  EXPECT_EQ(error.reason(), "INTERNAL");
  EXPECT_EQ(error.message(), "disk: on fire");
}

}  // namespace
}  // namespace carillon
