// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "server/excitation/contact.h"
#include "server/scene/sounding_body.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/oscillator_bank.h"
#include "server/synthesis/sounding_modes.h"
#include "server/synthesis/strike.h"

namespace carillon {

/// What an object is made of and how loud it is.
struct ObjectProperties {
  SoundingMaterial material;  ///< with the size relative to the model's
  /// Of the material; it must agree with the model's where it is given.
  std::optional<double> poisson_ratio;
  double gain = 1;  ///< linear
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
};

/// Applies material and size to a model and puts its bank on `mixer`.
/// Errors: InvalidArgument (INVALID_OBJECT: size or gain out of range), FailedPrecondition
/// (POISSON_RATIO_DIFFERS, NO_MODE_IN_BAND with the figure first_mode_hz), ResourceExhausted
/// (TOO_MANY_OBJECTS).
absl::StatusOr<SoundingObject> MakeSoundingObject(std::shared_ptr<const SoundingBody> body,
                                                  const ObjectProperties& properties, Mixer& mixer);

/// Where and how an impulse excites `object`. Points are in metres of the object as large as it is.
/// Errors: InvalidArgument (those of Validate and of SurfaceLocator).
absl::StatusOr<Excitation> LocateImpulse(const SoundingObject& object,
                                         const ContactImpulse& impulse);

}  // namespace carillon
