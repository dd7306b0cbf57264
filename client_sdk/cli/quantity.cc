// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/quantity.h"

#include <cmath>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/time/time.h"

namespace carillon::cli {

std::optional<double> ParseShare(const std::string& text) {
  double share = 0;
  if (!absl::SimpleAtod(absl::StripSuffix(text, "%"), &share)) return std::nullopt;
  if (absl::EndsWith(text, "%")) share /= 100;
  if (!(share > 0) || !std::isfinite(share)) return std::nullopt;
  return share;
}

std::optional<Budget> ParseBudget(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  Budget budget;
  const bool numbers = parts.size() <= 2 && absl::SimpleAtod(parts[0], &budget.seconds) &&
                       (parts.size() == 1 || absl::SimpleAtod(parts[1], &budget.gib));
  if (!numbers || !(budget.seconds >= 0 && budget.gib >= 0)) return std::nullopt;
  if (!std::isfinite(budget.seconds + budget.gib)) return std::nullopt;
  return budget;
}

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
