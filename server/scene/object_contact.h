// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "server/base/pose.h"
#include "server/excitation/contact.h"

namespace carillon {

/// The second object of a contact, which feels the opposite impulse.
struct SecondObject {
  uint32_t handle = 0;
  std::variant<Point, SurfacePoint> location;  ///< in the second object's frame
  /// From the first object's frame into the second's; absent: the poses of both say it.
  std::optional<Quaternion> rotation = std::nullopt;
};

/// A contact of one object of a scene, or of two.
struct ObjectContact {
  uint32_t handle = 0;
  ContactImpulse impulse{};
  std::optional<SecondObject> second = std::nullopt;
  /// Points may lie inside the bodies, as deep as an engine lets them reach into one another.
  bool found_by_engine = false;

  uint64_t object_count() const { return second ? 2 : 1; }
};

/// An impulse, at a time after its step's.
struct ObjectImpulse {
  ObjectContact contact{};
  double time_offset_s = 0;
};

/// A force that lasts.
struct ObjectForce {
  ObjectContact contact{};  ///< newtons in place of newton seconds
  Roughness roughness{};
};

/// A contact as an engine reports it, which may be a blow or a load.
struct ObjectTouch {
  ObjectContact contact{};  ///< the impulse is that of the whole step
  uint32_t partner = 0;     ///< names the other body
  Roughness roughness{};
  double time_offset_s = 0;  ///< of a blow
};

}  // namespace carillon
