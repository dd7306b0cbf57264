// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon::client {

/// The number and the time of a step of a stream or a trace, and the time of the step before, which
/// counts for nothing if there is none.
struct StepTime {
  uint64_t number = 0;  ///< from zero
  double time_s = 0;
  double previous_s = 0;
};

/// Checks that a time is at most kLargestStepTimeS before or after zero and does not go back. The
/// daemon ends a stream with any other time. The message of an error begins with `where`, such as
/// "FILE: ", and ends with `another`, the advice for another run of the simulation, such as "open
/// another stream". Errors: InvalidArgument (INVALID_STREAM).
absl::Status CheckStepTime(const StepTime& step, absl::string_view where,
                           absl::string_view another);

}  // namespace carillon::client
