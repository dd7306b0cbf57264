// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <variant>

#include "absl/status/statusor.h"
#include "server/base/pose.h"
#include "server/excitation/contact.h"
#include "server/scene/sounding_body.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/voice/voice.h"

namespace carillon {

/// What an object is made of, how loud it is, and where.
struct ObjectProperties {
  SoundingMaterial material;  ///< with the size relative to the model's
  /// Of the material; it must agree with the model's where it is given.
  std::optional<double> poisson_ratio;
  double gain = 1;                          ///< linear
  std::optional<Pose> pose = std::nullopt;  ///< as told last
};

/// An object that sounds, apart from its bank, which belongs to a mixer.
struct SoundingObject {
  std::shared_ptr<const SoundingBody> body;
  ObjectProperties properties;
  uint32_t mode_count = 0;         ///< that sound
  double lowest_frequency_hz = 0;  ///< natural, of those
  double highest_frequency_hz = 0;
  /// Natural frequency up to which the model is complete, where that is below the band's top.
  std::optional<double> complete_to_hz;
  BankId bank;
  std::shared_ptr<Voice> voice = nullptr;  ///< null where its place is not heard
};

/// The second object of a contact, which feels the opposite.
struct SecondObject {
  uint32_t handle = 0;
  std::variant<Point, SurfacePoint> location;  ///< in its frame
  /// From the first object's frame into this one's; absent: as the poses of both say.
  std::optional<Quaternion> rotation = std::nullopt;
};

/// Applies material and size to a model and puts its bank, heard through `voice`, on `mixer`.
/// Errors: InvalidArgument (INVALID_OBJECT: size or gain out of range; INVALID_POSE),
/// FailedPrecondition
/// (POISSON_RATIO_DIFFERS, NO_MODE_IN_BAND with the figure first_mode_hz), ResourceExhausted
/// (TOO_MANY_OBJECTS).
absl::StatusOr<SoundingObject> MakeSoundingObject(std::shared_ptr<const SoundingBody> body,
                                                  const ObjectProperties& properties, Mixer& mixer,
                                                  std::shared_ptr<Voice> voice = nullptr);

/// Where and how an impulse excites `object`. Points are in metres of the object as large as it is.
/// Errors: InvalidArgument (those of Validate and of SurfaceLocator).
absl::StatusOr<SurfaceImpulse> LocateImpulse(const SoundingObject& object,
                                             const ContactImpulse& impulse);

/// What an object feels of a contact.
struct Felt {
  uint32_t handle = 0;
  BankId bank{};
  SurfaceImpulse impulse{};
};

/// What the one or two objects of a contact feel.
struct FeltContact {
  std::array<Felt, 2> by{};
  size_t count = 0;

  std::span<const Felt> all() const { return std::span(by).first(count); }
};

/// A contact of one object. Errors: those of LocateImpulse.
absl::StatusOr<FeltContact> Feel(const ContactImpulse& impulse, uint32_t handle,
                                 const SoundingObject& object);

/// A contact of two. Errors: those of LocateImpulse, and InvalidArgument (INVALID_POSE: of the
/// rotation).
absl::StatusOr<FeltContact> Feel(const ContactImpulse& impulse, uint32_t handle,
                                 const SoundingObject& object, const SecondObject& contact,
                                 const SoundingObject& second);

}  // namespace carillon
