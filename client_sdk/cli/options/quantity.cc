// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/options/quantity.h"

#include <cmath>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
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

std::optional<double> ParseGain(const std::string& text) {
  absl::string_view number = text;
  constexpr double kMostGain = 1e6;
  const bool decibels = absl::EndsWithIgnoreCase(number, "dB");
  if (decibels) number.remove_suffix(2);
  double value = 0;
  if (!absl::SimpleAtod(number, &value) || !std::isfinite(value)) return std::nullopt;
  const double gain = decibels ? std::pow(10, value / 20) : value;
  return gain >= 0 && gain <= kMostGain ? std::optional<double>(gain) : std::nullopt;
}

}  // namespace carillon::cli
