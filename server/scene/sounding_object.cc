// SPDX-License-Identifier: Apache-2.0
#include "server/scene/sounding_object.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr double kSmallestSize = 0.001;
constexpr double kLargestSize = 1000;
constexpr double kLargestGain = 1000;
/// What a model's Poisson's ratio is rounded to, with room for the rounding of the sum.
constexpr double kPoissonTolerance = 1.0001e-4;

absl::Status OutOfRange(absl::string_view what, double value, double least, double most) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_OBJECT",
                 absl::StrCat(what, " is ", value, "; it must be ", least, " to ", most));
}

absl::Status Check(const ModalModel& model, const ObjectProperties& properties) {
  const double size = properties.material.size;
  if (!(size >= kSmallestSize && size <= kLargestSize)) {
    return OutOfRange("size", size, kSmallestSize, kLargestSize);
  }
  if (!(properties.gain >= 0 && properties.gain <= kLargestGain)) {
    return OutOfRange("gain", properties.gain, 0, kLargestGain);
  }
  if (properties.pose) {
    if (absl::Status status = Validate(*properties.pose); !status.ok()) return status;
  }
  const double wanted = properties.poisson_ratio.value_or(model.poisson_ratio);
  if (std::abs(wanted - model.poisson_ratio) <= kPoissonTolerance) return absl::OkStatus();
  absl::Status status = Refusal(
      absl::StatusCode::kFailedPrecondition, "POISSON_RATIO_DIFFERS",
      absl::StrCat(
          "the material's Poisson's ratio is ", wanted, " but the modal model was computed for ",
          model.poisson_ratio,
          "; create a modal model with the material's, or set poisson_ratio to the model's"));
  AddFigure(status, "model_poisson_ratio", absl::StrCat(model.poisson_ratio));
  return status;
}

absl::Status NoModeInBand(const ModalModel& model, const SoundingMaterial& material,
                          const SoundingBand& band) {
  if (model.eigenvalues.empty()) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
                   "the modal model holds no mode");
  }
  const double first_hz = NaturalFrequencyHz(model.eigenvalues.front(), material);
  const double last_hz = NaturalFrequencyHz(model.eigenvalues.back(), material);
  absl::Status status = Refusal(
      absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
      absl::StrCat("with this material and size the model's ", model.mode_count(), " modes lie at ",
                   first_hz, " to ", last_hz, " Hz, and none lies within ", band.lowest_hz, " to ",
                   band.highest_hz, " Hz and rings for ", band.shortest_t60_s * 1000,
                   " ms; change size, stiffness or damping"));
  AddFigure(status, "first_mode_hz", absl::StrCat(first_hz));
  return status;
}

/// The frequency up to which the model is complete, unless that is the top of the band.
std::optional<double> CompleteTo(const ModalModel& model, const SoundingMaterial& material,
                                 double top_hz) {
  const double complete_hz = NaturalFrequencyHz(model.complete_to_eigenvalue, material);
  // The limit asked for and this one are the same number along two ways of computing it.
  constexpr double kRounding = 1e-6;
  if (complete_hz >= top_hz * (1 - kRounding)) return std::nullopt;
  return complete_hz;
}

double DurationS(const SoundingObject& object, const ContactImpulse& impulse) {
  if (!impulse.hertz) return impulse.duration_s;
  return std::min(HertzDurationS(*impulse.hertz, object.properties.material.young_pa,
                                 object.body->model->poisson_ratio),
                  kLongestContactS);
}

/// With the striker's material, where the contact is that of elastic bodies and names none.
ContactImpulse StruckBy(const SoundingObject& striker, ContactImpulse impulse) {
  if (impulse.hertz && impulse.hertz->striker_young_pa == 0) {
    impulse.hertz->striker_young_pa = striker.properties.material.young_pa;
    impulse.hertz->striker_poisson_ratio = striker.body->model->poisson_ratio;
  }
  return impulse;
}

/// From the frame of `from` into that of `to`, as their poses say.
Quaternion RotationBetween(const SoundingObject& from, const SoundingObject& to) {
  const auto orientation = [](const SoundingObject& object) {
    const std::optional<Pose>& pose = object.properties.pose;
    return pose ? Normalized(pose->orientation) : Quaternion();
  };
  return Product(Inverse(orientation(to)), orientation(from));
}

}  // namespace

absl::StatusOr<SoundingObject> MakeSoundingObject(std::shared_ptr<const SoundingBody> body,
                                                  const ObjectProperties& properties, Mixer& mixer,
                                                  std::shared_ptr<Voice> voice) {
  const ModalModel& model = *body->model;
  if (absl::Status status = Check(model, properties); !status.ok()) return status;
  const SoundingBand band;
  const MixerSettings& settings = mixer.settings();
  const SoundingModes sounding = SelectSoundingModes(
      model.eigenvalues, model.couplings, properties.material, settings.sample_rate_hz, band);
  if (sounding.modes.empty()) return NoModeInBand(model, properties.material, band);
  absl::StatusOr<BankId> bank =
      mixer.Add(std::make_unique<OscillatorBank>(
                    sounding, body->shapes,
                    OscillatorBankSettings{.sample_rate_hz = settings.sample_rate_hz,
                                           .block_frame_count = settings.block_frame_count,
                                           .gain = properties.gain}),
                voice);
  if (!bank.ok()) return bank.status();
  const double top_hz = std::min(band.highest_hz, settings.sample_rate_hz / 2);
  return SoundingObject{.body = std::move(body),
                        .properties = properties,
                        .mode_count = static_cast<uint32_t>(sounding.modes.size()),
                        .lowest_frequency_hz = sounding.modes.front().natural_frequency_hz,
                        .highest_frequency_hz = sounding.modes.back().natural_frequency_hz,
                        .complete_to_hz = CompleteTo(model, properties.material, top_hz),
                        .bank = *bank,
                        .voice = std::move(voice)};
}

absl::StatusOr<SurfaceImpulse> LocateImpulse(const SoundingObject& object,
                                             const ContactImpulse& impulse) {
  if (absl::Status status = Validate(impulse); !status.ok()) return status;
  const SurfaceLocator& locator = *object.body->locator;
  absl::StatusOr<LocatedPoint> located = absl::UnknownError("");
  if (const auto* on_surface = std::get_if<SurfacePoint>(&impulse.location)) {
    located = locator.OnGivenTriangle(*on_surface);
  } else {
    Point point = std::get<Point>(impulse.location);
    for (double& coordinate : point) coordinate /= object.properties.material.size;
    located = locator.Nearest(point);
  }
  if (!located.ok()) return located.status();
  SurfaceImpulse felt{.at = {.vertices = located->vertices},
                      .tau_s = static_cast<float>(GaussianTauS(DurationS(object, impulse)))};
  std::ranges::transform(located->weights, felt.at.weights.begin(),
                         [](double weight) { return static_cast<float>(weight); });
  std::ranges::transform(impulse.impulse_newton_seconds, felt.impulse_newton_seconds.begin(),
                         [](double component) { return static_cast<float>(component); });
  return felt;
}

absl::StatusOr<FeltContact> Feel(const ContactImpulse& impulse, uint32_t handle,
                                 const SoundingObject& object) {
  const absl::StatusOr<SurfaceImpulse> felt = LocateImpulse(object, impulse);
  if (!felt.ok()) return felt.status();
  return FeltContact{.by = {Felt{handle, object.bank, *felt}}, .count = 1};
}

absl::StatusOr<FeltContact> Feel(const ContactImpulse& impulse, uint32_t handle,
                                 const SoundingObject& object, const SecondObject& contact,
                                 const SoundingObject& second) {
  const Quaternion rotation = contact.rotation.value_or(RotationBetween(object, second));
  if (absl::Status status = Validate(rotation); !status.ok()) return status;
  absl::StatusOr<FeltContact> felt = Feel(StruckBy(second, impulse), handle, object);
  if (!felt.ok()) return felt;
  ContactImpulse opposite{.location = contact.location};
  const Vector3 turned = Rotated(impulse.impulse_newton_seconds, Normalized(rotation));
  std::ranges::transform(turned, opposite.impulse_newton_seconds.begin(), std::negate());
  const absl::StatusOr<SurfaceImpulse> answered = LocateImpulse(second, opposite);
  if (!answered.ok()) return answered.status();
  felt->by[1] = {contact.handle, second.bank, *answered};
  felt->by[1].impulse.tau_s = felt->by[0].impulse.tau_s;
  felt->count = 2;
  return felt;
}

}  // namespace carillon
