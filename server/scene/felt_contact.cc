// SPDX-License-Identifier: Apache-2.0
#include "server/scene/felt_contact.h"

#include <algorithm>
#include <functional>

#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

/// How long `object` and its striker touch.
double DurationS(const SoundingObject& object, const ContactImpulse& impulse,
                 const SoundingObject* striker) {
  if (!impulse.hertz) return impulse.duration_s;
  HertzContact hertz = *impulse.hertz;
  if (hertz.striker_young_pa == 0 && striker != nullptr) {
    hertz.striker_young_pa = striker->properties.material.young_pa;
    hertz.striker_poisson_ratio = striker->body->model->poisson_ratio;
  }
  return std::min(
      HertzDurationS(hertz, object.properties.material.young_pa, object.body->model->poisson_ratio),
      kLongestContactS);
}

absl::StatusOr<LocatedPoint> Locate(const SoundingObject& object,
                                    const std::variant<Point, SurfacePoint>& location) {
  const SurfaceLocator& locator = *object.body->locator;
  if (const auto* on_surface = std::get_if<SurfacePoint>(&location)) {
    return locator.OnGivenTriangle(*on_surface);
  }
  Point point = std::get<Point>(location);
  for (double& coordinate : point) coordinate /= object.properties.material.size;
  return locator.Nearest(point);
}

/// Returns the rotation from the frame of `from` into that of `to` that their poses say.
Quaternion RotationBetween(const SoundingObject& from, const SoundingObject& to) {
  const auto orientation = [](const SoundingObject& object) {
    const std::optional<Pose>& pose = object.properties.pose;
    return pose ? Normalized(pose->orientation) : Quaternion();
  };
  return Product(Inverse(orientation(to)), orientation(from));
}

absl::Status FillIn(const SoundingObject& object, const ContactImpulse& impulse,
                    const SoundingObject* striker, SurfaceImpulse& felt) {
  RETURN_IF_ERROR(Validate(impulse));
  ASSIGN_OR_RETURN(const LocatedPoint& located, Locate(object, impulse.location));
  const auto narrow = [](double x) { return static_cast<float>(x); };
  felt.at.vertices = located.vertices;
  std::ranges::transform(located.weights, felt.at.weights.begin(), narrow);
  std::ranges::transform(impulse.impulse_newton_seconds, felt.impulse_newton_seconds.begin(),
                         narrow);
  felt.tau_s = narrow(GaussianTauS(DurationS(object, impulse, striker)));
  return absl::OkStatus();
}

/// Fills in the opposite impulse, which the second object feels for as long as the first does.
absl::Status FeelOpposite(const ObjectContact& contact, const SoundingObject& object,
                          const SoundingObject& second, FeltContact& felt) {
  const Quaternion rotation = contact.second->rotation.value_or(RotationBetween(object, second));
  const Vector3 turned = Rotated(contact.impulse.impulse_newton_seconds, Normalized(rotation));
  ContactImpulse opposite{.location = contact.second->location};
  std::ranges::transform(turned, opposite.impulse_newton_seconds.begin(), std::negate());
  felt.by[1] = {.handle = contact.second->handle, .event = {.bank = second.bank}};
  auto& impulse = std::get<SurfaceImpulse>(felt.by[1].event.action);
  RETURN_IF_ERROR(FillIn(second, opposite, nullptr, impulse));
  impulse.tau_s = felt.by[0].impulse().tau_s;
  felt.count = 2;
  return absl::OkStatus();
}

}  // namespace

absl::Status Feel(const ObjectContact& contact, const SoundingObject& object,
                  const SoundingObject* second, FeltContact& felt) {
  if (second != nullptr && contact.second->rotation) {
    RETURN_IF_ERROR(Validate(*contact.second->rotation));
  }
  felt.by[0] = {.handle = contact.handle, .event = {.bank = object.bank}};
  auto& impulse = std::get<SurfaceImpulse>(felt.by[0].event.action);
  RETURN_IF_ERROR(FillIn(object, contact.impulse, second, impulse));
  felt.count = 1;
  return second == nullptr ? absl::OkStatus() : FeelOpposite(contact, object, *second, felt);
}

}  // namespace carillon
