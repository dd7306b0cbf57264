// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/quantity.h"

#include "absl/time/time.h"

namespace carillon::cli {

std::optional<int64_t> ParseTimeUnixMs(const std::string& text) {
  for (const char* format :
       {"%Y-%m-%d", "%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S", absl::RFC3339_full}) {
    absl::Time time;
    if (absl::ParseTime(format, text, absl::LocalTimeZone(), &time, nullptr)) {
      return absl::ToUnixMillis(time);
    }
  }
  return std::nullopt;
}

}  // namespace carillon::cli
