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
  std::variant<Point, SurfacePoint> location;  ///< location in the second object's frame
  /// Rotates from the first object's frame into the second's. If it is absent, the rotation follows
  /// from the poses of both objects.
  std::optional<Quaternion> rotation = std::nullopt;
};

/// The place of a report among several of its step, which the message of a rejection names.
struct ReportPlace {
  const char* list = nullptr;  ///< a field of ContactStep; null if the report is the only one
  uint32_t index = 0;
};

/// A contact of one or two objects of a scene.
struct ObjectContact {
  uint32_t handle = 0;
  ContactImpulse impulse{};
  std::optional<SecondObject> second = std::nullopt;
  ReportPlace place{};

  uint64_t object_count() const { return second ? 2 : 1; }
};

/// An impulse, at the time of its step plus an offset.
struct ObjectImpulse {
  ObjectContact contact{};
  double time_offset_s = 0;
};

/// A force that lasts.
struct ObjectForce {
  ObjectContact contact{};  ///< the impulse is in newtons, not newton seconds
  Roughness roughness{};
};

/// A contact as an engine reports it, which may be a blow or a load.
struct ObjectTouch {
  ObjectContact contact{};  ///< the impulse is that of the whole step
  uint32_t partner = 0;     ///< names the other body
  Roughness roughness{};
  double time_offset_s = 0;  ///< time offset of a blow
};

}  // namespace carillon
