// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <variant>

#include "absl/status/status.h"
#include "server/excitation/yielding_contact.h"
#include "server/scene/object_contact.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// The impulse of a contact on one object, as the event that the object's bank gets.
struct BodyImpulse {
  uint32_t handle = 0;
  MixerEvent event{};     ///< a SurfaceImpulse; gets its time when it is sent
  double distance_m = 0;  ///< distance from the point of the contact to the surface
  double extent_m = 0;    ///< extent of the object
  double mass_kg = 1;     ///< mass of the object
  Vector3 point_m{};      ///< the point on the surface, in the object's frame at its size
  /// The part of the impulse that determines the duration, N s, in the object's frame: the one
  /// along the contact's normal, or all of it if nobody told the normal.
  Vector3 pressing{};
  /// The angular impulse of that part about the centre of mass, times a root of the inverse tensor
  /// of inertia. Half the square of this vector is the energy, J, of the rotation that the impulse
  /// gives an object at rest.
  Vector3 turn{};
  /// The impulse that gives the whole object ten times the speed of sound in its material. No body
  /// withstands even a tenth of this impulse.
  double largest_newton_seconds = std::numeric_limits<double>::infinity();
  uint64_t serial = 0;    ///< the object's, on whose surface the point was found
  Collision collision{};  ///< the collision that gives the duration, unless it is stated

  const SurfaceImpulse& impulse() const { return std::get<SurfaceImpulse>(event.action); }
};

/// The impulses of a contact on its one or two objects.
struct BodyImpulses {
  std::array<BodyImpulse, 2> by{};
  size_t count = 0;
  /// Whether the duration was computed from the impulse, so that a greater impulse has a shorter
  /// contact.
  bool duration_follows_impulse = false;
  bool mass_is_stated = false;  ///< whether the client stated the reduced mass
  /// One over the mass of a body that is no object, 1/kg; nothing if nobody stated its mass.
  std::optional<double> striker_per_kg = 0;

  std::span<BodyImpulse> all() { return std::span(by).first(count); }
  std::span<const BodyImpulse> all() const { return std::span(by).first(count); }
};

/// The duration of an elastic collision is proportional to the speed, and so to the impulse, to
/// this power.
inline constexpr double kDurationPower = -0.2;
/// The same for the reduced mass at a given speed.
inline constexpr double kMassPower = 0.4;

/// Who found the points of a contact.
enum class PointSource {
  kClient,
  kEngine,  ///< points may lie inside the bodies, because engines let bodies overlap
};

/// Fills in the impulses that `contact` gives to `object` and, in a contact of two objects, to
/// `second`. Points are in metres of the object at its size. If the contact states no duration, the
/// duration is that of the collision of `object` with `second` or, if that is null, with the tip of
/// a steel hammer. Errors: InvalidArgument (INVALID_POSE: the rotation between the objects, and
/// those of Validate and of SurfaceLocator).
absl::Status FindBodyImpulses(const ObjectContact& contact, PointSource source,
                              const SoundingObject& object, const SoundingObject* second,
                              BodyImpulses& impulses);

}  // namespace carillon
