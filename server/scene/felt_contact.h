// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include "absl/status/status.h"
#include "server/scene/object_contact.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// The impulse that one object feels of a contact, as the event that its bank gets.
struct Felt {
  uint32_t handle = 0;
  MixerEvent event{};  ///< a SurfaceImpulse; its time is set when it is sent

  const SurfaceImpulse& impulse() const { return std::get<SurfaceImpulse>(event.action); }
};

/// The impulses that the one or two objects of a contact feel.
struct FeltContact {
  std::array<Felt, 2> by{};
  size_t count = 0;

  std::span<Felt> all() { return std::span(by).first(count); }
  std::span<const Felt> all() const { return std::span(by).first(count); }
};

/// Fills in the impulses that `object`, and in a contact of two `second`, feel of `contact`. Points
/// are in metres of the object at its size. If the contact is that of elastic bodies and names no
/// striker, each object is the other's striker, and a single object meets one of its own material.
/// Errors: InvalidArgument (INVALID_POSE: the rotation between the objects, and those of Validate
/// and of SurfaceLocator).
absl::Status Feel(const ObjectContact& contact, const SoundingObject& object,
                  const SoundingObject* second, FeltContact& felt);

}  // namespace carillon
