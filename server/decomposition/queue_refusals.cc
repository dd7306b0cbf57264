// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/queue_refusals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

absl::Status JobNotFound(const std::string& digest) {
  return Refusal(absl::StatusCode::kNotFound, "JOB_NOT_FOUND",
                 absl::StrCat("no job is named jobs/", digest, ": create the modal model again"));
}

absl::Status QueueFull(size_t count, double retry_after_s) {
  const int64_t seconds = std::max<int64_t>(1, std::llround(retry_after_s));
  absl::Status status =
      Refusal(absl::StatusCode::kResourceExhausted, "QUEUE_FULL",
              absl::StrCat(count, " decompositions wait already: try again in ", seconds, " s"));
  AddFigure(status, "retry_after_s", absl::StrCat(seconds));
  return status;
}

absl::Status ClientQueueFull(size_t count, size_t whole) {
  return Refusal(absl::StatusCode::kResourceExhausted, "CLIENT_LIMIT_REACHED",
                 absl::StrCat(count, " decompositions of this client wait already, its share of ",
                              whole, ": wait until some have run"));
}

}  // namespace carillon
