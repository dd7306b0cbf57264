// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/contact.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"

namespace carillon {
namespace {

bool Finite(const std::array<double, 3>& vector) {
  return std::ranges::all_of(vector, [](double x) { return std::isfinite(x); });
}

absl::Status Invalid(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

}  // namespace

absl::Status ValidatePoint(const Point& point) {
  if (Finite(point)) return absl::OkStatus();
  return Invalid(
      "POINT_NOT_FINITE",
      "the point of contact has a coordinate that is not a finite number: send metres in "
      "the object's frame");
}

absl::Status ValidateWeights(const std::array<double, 3>& weights) {
  constexpr double kRounding = 1e-6;  // weights that were single precision at the client
  const double sum = weights[0] + weights[1] + weights[2];
  const bool inside = std::ranges::all_of(weights, [](double w) { return w >= -kRounding; });
  if (inside && std::abs(sum - 1) <= kRounding) return absl::OkStatus();
  return Invalid("INVALID_WEIGHTS",
                 absl::StrCat("barycentric weights ", weights[0], ", ", weights[1], ", ",
                              weights[2], ": none may be below zero, and their sum must be 1"));
}

absl::Status Validate(const ContactImpulse& contact) {
  if (!Finite(contact.impulse_newton_seconds)) {
    return Invalid("IMPULSE_NOT_FINITE",
                   "the impulse has a component that is not a finite number: send N s in the "
                   "object's frame");
  }
  if (!(contact.duration_s >= 0 && contact.duration_s <= kLongestContactS)) {
    return Invalid("INVALID_DURATION",
                   absl::StrCat("a contact of ", contact.duration_s,
                                " s: the duration must lie from 0 to ", kLongestContactS, " s"));
  }
  if (const auto* point = std::get_if<Point>(&contact.location)) return ValidatePoint(*point);
  return ValidateWeights(std::get<SurfacePoint>(contact.location).weights);
}

}  // namespace carillon
