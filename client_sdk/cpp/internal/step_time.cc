// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/step_time.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/shortest_decimal.h"

namespace carillon::client {

absl::Status CheckStepTime(const StepTime& step, absl::string_view where,
                           absl::string_view another) {
  if (!(std::abs(step.time_s) <= kLargestStepTimeS)) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
        absl::StrCat(where, "time_s of step ", step.number, " is ", ShortestDecimal(step.time_s),
                     "; give the simulation time in seconds, at most ", kLargestStepTimeS,
                     " before or after 0"));
  }
  if (step.number == 0 || step.time_s >= step.previous_s) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                 absl::StrCat(where, "time goes back from ", ShortestDecimal(step.previous_s),
                              " s to ", ShortestDecimal(step.time_s), " s at step ", step.number,
                              "; ", another, " for another run"));
}

}  // namespace carillon::client
