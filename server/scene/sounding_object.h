// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "server/base/pose.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/transfer.h"
#include "server/mode_database/transfer_store.h"
#include "server/scene/sounding_body.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/voice/voice.h"

namespace carillon {

/// How the motion of an object's surface becomes sound.
enum class RadiationModel {
  kDefault,        ///< kRadiatedPower if a transfer is stored, otherwise kPaperCoupling
  kPaperCoupling,  ///< every mode radiates like a plane wave, and radiation does not damp it
  kRadiatedPower,  ///< each mode radiates, and is damped, by the power of a stored transfer;
                   ///< acceleration noise of a free body is added
  kModesOnly,      ///< kRadiatedPower without acceleration noise
};

/// Material, loudness, place and radiation of an object.
struct ObjectProperties {
  SoundingMaterial material;  ///< its size is relative to the model's
  /// Poisson's ratio of the material. If present, it must be one that the model serves; see
  /// ServesPoissonRatio.
  std::optional<double> poisson_ratio;
  double gain = 1;                          ///< linear
  std::optional<Pose> pose = std::nullopt;  ///< the newest pose
  RadiationModel radiation = RadiationModel::kDefault;
};

/// Returns the Poisson's ratio with which an object sounds: the model's own, if the stated one is
/// the same as models round it.
double PoissonRatioOf(const ModalModel& model, const ObjectProperties& properties);

/// The modes of an object, by which its surface yields to a blow.
struct YieldingModes {
  struct Mode {
    uint32_t column = 0;  ///< in the modal model
    float damped_rad_per_s = 0;
    float decay_rate_per_s = 0;
  };
  std::vector<Mode> modes;
  double shape_scale = 1;  ///< phi = shape_scale * phi of the model
};

/// An object that sounds. Its oscillator bank belongs to a mixer.
struct SoundingObject {
  std::shared_ptr<const SoundingBody> body;
  ObjectProperties properties;
  /// The modes that sound; none may, see `clicks`.
  std::shared_ptr<const YieldingModes> yielding;
  uint32_t mode_count = 0;          ///< number of modes that sound
  double lowest_frequency_hz = 0;   ///< lowest natural frequency of those modes; zero if none
  double highest_frequency_hz = 0;  ///< highest natural frequency of those modes
  /// Natural frequency up to which the model is complete. Absent if the model is complete up to the
  /// top of the band.
  std::optional<double> complete_to_hz;
  BankId bank;
  BusId bus{};                             ///< bus of the bank
  std::shared_ptr<Voice> voice = nullptr;  ///< null in a scene without spatial audio
  bool clicks = false;  ///< whether the acceleration of the body by each blow sounds, too
  /// The transfer by which the modes radiate; null if they radiate by the paper's coupling.
  std::shared_ptr<const Transfer> transfer = nullptr;
  /// Tells the object from others that had its handle in its scene before; see Scene::Insert.
  uint64_t serial = 0;
};

/// Returns the transfer that an object's properties ask for, or null for the paper's coupling.
/// `transfers` is null if none are stored. Errors: FailedPrecondition (TRANSFER_NOT_FOUND).
absl::StatusOr<std::shared_ptr<const Transfer>> ChooseTransfer(const ModalModel& model,
                                                               const ObjectProperties& properties,
                                                               TransferStore* transfers);

/// Checks that an object of the model with these properties would sound at this sampling rate.
/// Errors: those of MakeSoundingObject, except TOO_MANY_OBJECTS.
absl::Status CheckSounds(const ModalModel& model, const ObjectProperties& asked,
                         double sample_rate_hz, TransferStore* transfers);

/// A bus of a mixer.
struct MixerBus {
  Mixer& mixer;
  BusId bus{};
};

/// Applies material and size to a model, and puts its oscillator bank with `voice` on a bus.
/// Errors: InvalidArgument (INVALID_SETTINGS: size or gain out of range; INVALID_POSE),
/// FailedPrecondition (POISSON_RATIO_DIFFERS, NO_MODE_IN_BAND with the figure first_mode_hz,
/// REGION_MATERIAL_DIFFERS), ResourceExhausted (TOO_MANY_OBJECTS), and those of ChooseTransfer,
/// unless `chosen` points to the object's transfer.
absl::StatusOr<SoundingObject> MakeSoundingObject(
    std::shared_ptr<const SoundingBody> body, const ObjectProperties& asked, const MixerBus& output,
    std::shared_ptr<Voice> voice = nullptr, TransferStore* transfers = nullptr,
    const std::shared_ptr<const Transfer>* chosen = nullptr);

}  // namespace carillon
