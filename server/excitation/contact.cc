// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

/// Returns whether every component is a number and at most `most` in magnitude.
bool Finite(const std::array<double, 3>& vector, double most = std::numeric_limits<double>::max()) {
  return std::ranges::all_of(vector, [most](double x) { return std::abs(x) <= most; });
}

/// Returns a vector as the user may have written it, such as "0, nan, 0.1".
std::string Text(const std::array<double, 3>& vector) {
  return absl::StrCat(vector[0], ", ", vector[1], ", ", vector[2]);
}

absl::Status Invalid(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

bool Positive(double x) { return std::isfinite(x) && x > 0; }

absl::Status Validate(const HertzContact& hertz) {
  const auto positive = [](const std::optional<double>& x) { return !x || Positive(*x); };
  const double poisson = hertz.striker_poisson_ratio.value_or(0);
  if (positive(hertz.reduced_mass_kg) && positive(hertz.reduced_radius_m) &&
      positive(hertz.approach_speed_m_per_s) && positive(hertz.striker_young_pa) &&
      positive(hertz.striker_mass_kg) && positive(hertz.striker_radius_m) && poisson > -1 &&
      poisson < 0.5) {
    return absl::OkStatus();
  }
  return Invalid(
      "CONTACT_MALFORMED",
      "masses, radii, the approach speed and the striker's Young's modulus must be above "
      "zero, its Poisson's ratio above -1 and below 0.5; leave out what is not known");
}

}  // namespace

absl::Status ValidatePoint(const Point& point) {
  if (Finite(point)) return absl::OkStatus();
  return Invalid("CONTACT_MALFORMED",
                 absl::StrCat("the point of contact ", Text(point),
                              " has a coordinate that is not a finite number: send metres"));
}

absl::Status ValidateWeights(const std::array<double, 3>& weights) {
  constexpr double kRounding = 1e-6;  // for weights that the client computed in single precision
  const double sum = weights[0] + weights[1] + weights[2];
  const bool inside = std::ranges::all_of(weights, [](double w) { return w >= -kRounding; });
  if (inside && std::abs(sum - 1) <= kRounding) return absl::OkStatus();
  return Invalid("CONTACT_MALFORMED",
                 absl::StrCat("barycentric weights ", Text(weights),
                              ": none may be below zero, and their sum must be 1"));
}

absl::Status Validate(const ContactImpulse& contact) {
  // Impulses are rendered in single precision.
  if (!Finite(contact.impulse_newton_seconds, std::numeric_limits<float>::max())) {
    return Invalid(
        "CONTACT_MALFORMED",
        absl::StrCat("the impulse ", Text(contact.impulse_newton_seconds),
                     " has a component that is not a finite number, or is beyond 3.4e38: send N "
                     "s"));
  }
  const double duration_s = contact.duration_s.value_or(0);
  if (!(duration_s >= 0 && duration_s <= kLongestContactS)) {
    return Invalid("CONTACT_MALFORMED",
                   absl::StrCat("a contact of ", duration_s, " s: the duration must lie from 0 to ",
                                kLongestContactS, " s, or be absent"));
  }
  RETURN_IF_ERROR(Validate(contact.hertz));
  if (!Finite(contact.normal)) {
    return Invalid("CONTACT_MALFORMED",
                   absl::StrCat("the normal ", Text(contact.normal),
                                " has a component that is not a finite number: send a direction, "
                                "or leave it out"));
  }
  if (const auto* point = std::get_if<Point>(&contact.location)) return ValidatePoint(*point);
  return ValidateWeights(std::get<SurfacePoint>(contact.location).weights);
}

absl::Status Validate(const Roughness& roughness) {
  constexpr double kDeepest = 10;
  if (std::isfinite(roughness.travel_speed_m_per_s) && roughness.travel_speed_m_per_s >= 0 &&
      roughness.depth >= 0 && roughness.depth <= kDeepest &&
      Positive(roughness.irregularity_length_m)) {
    return absl::OkStatus();
  }
  return Invalid(
      "CONTACT_MALFORMED",
      absl::StrCat("a roughness of depth ", roughness.depth, ", irregularities of ",
                   roughness.irregularity_length_m, " m, travelled at ",
                   roughness.travel_speed_m_per_s, " m/s: the depth must be 0 to ", kDeepest,
                   ", the length of the irregularities above zero, the speed zero or more"));
}

}  // namespace carillon
