// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/quantity.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace carillon {
namespace {

std::optional<double> ParsePositive(absl::string_view text) {
  double number = 0;
  if (absl::SimpleAtod(text, &number) && number > 0 && std::isfinite(number)) return number;
  return std::nullopt;
}

}  // namespace

std::optional<double> ParseShare(const std::string& text) {
  const std::optional<double> number = ParsePositive(absl::StripSuffix(text, "%"));
  if (!number) return std::nullopt;
  const double share = absl::EndsWith(text, "%") ? *number / 100 : *number;
  // Who gives 1 means 1 %, and not 100 %.
  return share < 1 ? std::optional<double>(share) : std::nullopt;
}

std::optional<Budget> ParseBudget(const std::string& text) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  Budget budget;
  const bool numbers = parts.size() <= 2 && absl::SimpleAtod(parts[0], &budget.seconds) &&
                       (parts.size() == 1 || absl::SimpleAtod(parts[1], &budget.gib));
  if (!numbers || !(budget.seconds >= 0 && budget.gib >= 0)) return std::nullopt;
  if (budget.seconds == 0 && budget.gib == 0) return std::nullopt;  // would be no budget
  if (!std::isfinite(budget.seconds + budget.gib)) return std::nullopt;
  return budget;
}

std::optional<double> ParseUnitM(const std::string& text) {
  const std::map<std::string, double> metres = {
      {"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}};
  if (const auto named = metres.find(text); named != metres.end()) return named->second;
  return ParsePositive(text);
}

std::optional<double> ParseLengthM(const std::string& text) {
  const size_t digits = std::min(text.find_first_not_of("0123456789.eE+-"), text.size());
  const std::optional<double> number = ParsePositive(text.substr(0, digits));
  const std::optional<double> unit = digits == text.size() ? 1 : ParseUnitM(text.substr(digits));
  if (!number || !unit) return std::nullopt;
  return *number * *unit;
}

}  // namespace carillon
