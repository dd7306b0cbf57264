// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

/// Whether every component is a number and no component is larger than `most`.
bool Finite(const std::array<double, 3>& vector, double most = std::numeric_limits<double>::max()) {
  return std::ranges::all_of(vector, [most](double x) { return std::abs(x) <= most; });
}

absl::Status Invalid(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

bool Positive(double x) { return std::isfinite(x) && x > 0; }

absl::Status ValidateHertz(const ContactImpulse& contact) {
  if (!contact.hertz) return absl::OkStatus();
  const HertzContact& hertz = *contact.hertz;
  if (Positive(hertz.reduced_mass_kg) && Positive(hertz.reduced_radius_m) &&
      Positive(hertz.approach_speed_m_per_s) && std::isfinite(hertz.striker_young_pa) &&
      hertz.striker_young_pa >= 0 && std::abs(hertz.striker_poisson_ratio) < 1 &&
      hertz.striker_poisson_ratio < 0.5) {
    return absl::OkStatus();
  }
  return Invalid(
      "INVALID_HERTZ_CONTACT",
      "reduced mass, reduced radius and approach speed must be above zero, the striker's "
      "Young's modulus zero or more, its Poisson's ratio above -1 and below 0.5");
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
  // Impulses are rendered in single precision.
  if (!Finite(contact.impulse_newton_seconds, std::numeric_limits<float>::max())) {
    return Invalid(
        "IMPULSE_NOT_FINITE",
        "the impulse has a component that is not a finite number, or is beyond 3.4e38: send N s in "
        "the object's frame");
  }
  if (!(contact.duration_s >= 0 && contact.duration_s <= kLongestContactS)) {
    return Invalid("INVALID_DURATION",
                   absl::StrCat("a contact of ", contact.duration_s,
                                " s: the duration must lie from 0 to ", kLongestContactS, " s"));
  }
  RETURN_IF_ERROR(ValidateHertz(contact));
  if (const auto* point = std::get_if<Point>(&contact.location)) return ValidatePoint(*point);
  return ValidateWeights(std::get<SurfacePoint>(contact.location).weights);
}

absl::Status Validate(const Roughness& roughness) {
  constexpr double kDeepest = 10;
  if (std::isfinite(roughness.travel_speed_m_per_s) && roughness.travel_speed_m_per_s >= 0 &&
      roughness.depth >= 0 && roughness.depth <= kDeepest && Positive(roughness.grain_m)) {
    return absl::OkStatus();
  }
  return Invalid("INVALID_ROUGHNESS",
                 absl::StrCat("a roughness of depth ", roughness.depth, ", grain ",
                              roughness.grain_m, " m, travelled at ",
                              roughness.travel_speed_m_per_s, " m/s: the depth must be 0 to ",
                              kDeepest, ", the grain above zero, the speed zero or more"));
}

double HertzDurationS(const HertzContact& contact, double young_pa, double poisson_ratio) {
  const auto compliance = [](double young, double poisson) {
    return (1 - poisson * poisson) / young;
  };
  const double own = compliance(young_pa, poisson_ratio);
  const double striker = contact.striker_young_pa > 0
                             ? compliance(contact.striker_young_pa, contact.striker_poisson_ratio)
                             : own;
  const double modulus = 1 / (own + striker);
  const double mass = contact.reduced_mass_kg;
  return 2.87 * std::pow(mass * mass /
                             (contact.reduced_radius_m * modulus * modulus *
                              contact.approach_speed_m_per_s),
                         0.2);
}

}  // namespace carillon
