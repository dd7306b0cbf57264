// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/loss_factor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

double LossFactorAt(std::span<const LossFactorPoint> points, double frequency_hz) {
  if (points.empty() || points.front().loss_factor == 0) return 0;
  const auto above = std::ranges::upper_bound(points, frequency_hz, std::ranges::less(),
                                              &LossFactorPoint::frequency_hz);
  if (above == points.begin()) return points.front().loss_factor;
  if (above == points.end()) return points.back().loss_factor;
  const LossFactorPoint& below = *(above - 1);
  const double part = std::log(frequency_hz / below.frequency_hz) /
                      std::log(above->frequency_hz / below.frequency_hz);
  return below.loss_factor * std::pow(above->loss_factor / below.loss_factor, part);
}

absl::StatusOr<std::vector<LossFactorPoint>> ReadLossFactor(absl::string_view text) {
  std::vector<LossFactorPoint> points;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    std::pair<absl::string_view, absl::string_view> pair = absl::StrSplit(part, ':');
    const bool constant = pair.second.empty() && text == part;
    if (constant) pair = {"1000", part};
    LossFactorPoint point;
    if (!absl::SimpleAtod(pair.first, &point.frequency_hz) ||
        !absl::SimpleAtod(pair.second, &point.loss_factor)) {
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                     absl::StrCat("the loss factor is \"", text,
                                  "\"; give a number, or frequencies with their loss factors, such "
                                  "as 100:0.001,1000:0.002"));
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace carillon
