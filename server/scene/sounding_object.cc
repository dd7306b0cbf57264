// SPDX-License-Identifier: Apache-2.0
#include "server/scene/sounding_object.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/poisson_change.h"
#include "proto/cpp/status_macros.h"
#include "server/synthesis/bank/level.h"

namespace carillon {
namespace {

constexpr double kSmallestSize = 0.001;
constexpr double kLargestSize = 1000;
constexpr double kLargestGain = 1000;
/// Largest relative difference of two factors that count as the same.
constexpr double kSameFactor = 1e-6;

absl::Status Differs(absl::string_view what) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "REGION_MATERIAL_DIFFERS", what);
}

/// Returns the material of a region, or null if there is none.
const RegionMaterial* Find(const SoundingMaterial& material, const std::string& region) {
  for (const std::string& name : {region, std::string()}) {
    const auto found = std::ranges::find_if(material.regions, [&](const RegionMaterial& one) {
      return absl::EqualsIgnoreCase(one.region, name);
    });
    if (found != material.regions.end()) return &*found;
  }
  return nullptr;
}

bool IsSame(double factor, double first) { return std::abs(factor / first - 1) <= kSameFactor; }

/// Gives `material` the regions of the model, in the model's order, and its reference. Names are
/// compared without regard to the case of letters. The materials of the regions must be those that
/// the model was computed for, except for factors of Young's modulus and density that are common to
/// all regions. A model of one material leaves `material` as it is. Errors: FailedPrecondition
/// (REGION_MATERIAL_DIFFERS).
absl::Status MatchRegions(const ModalModel& model, SoundingMaterial& material) {
  if (model.regions.empty() && material.regions.empty()) return absl::OkStatus();
  if (model.regions.empty() || material.regions.empty()) {
    return Differs(
        model.regions.empty()
            ? "the material has regions, and the model was computed for one material: "
              "give one material, or create the model with these regions"
            : "the model was computed for several materials, and one is given: give each "
              "region its material, or none, and the object gets those of the model");
  }
  std::vector<RegionMaterial> matched;
  matched.reserve(model.regions.size());
  for (const ModelRegion& region : model.regions) {
    const RegionMaterial* const found = Find(material, region.name);
    if (found == nullptr) {
      return Differs(absl::StrCat("the region \"", region.name,
                                  "\" of the model has no material: give it one"));
    }
    RegionMaterial& one = matched.emplace_back(*found);
    one.region = region.name;
    const double young_pa = one.young_pa / region.relative_young;
    const double density_kg_per_m3 = one.density_kg_per_m3 / region.relative_density;
    if (matched.size() == 1) {
      material.young_pa = young_pa;
      material.density_kg_per_m3 = density_kg_per_m3;
    }
    const double poisson_ratio = one.poisson_ratio.value_or(region.poisson_ratio);
    if (IsSame(young_pa, material.young_pa) &&
        IsSame(density_kg_per_m3, material.density_kg_per_m3) &&
        ServesPoissonRatio(region.poisson_ratio, poisson_ratio, false)) {
      continue;
    }
    return Differs(absl::StrCat(
        "the material of the region \"", region.name,
        "\" differs from that of the model by another factor than that of \"",
        model.regions[0].name, "\", or in Poisson's ratio: create a model with these materials"));
  }
  for (const RegionMaterial& given : material.regions) {
    const auto is_its = [&](const ModelRegion& region) {
      return given.region.empty() || absl::EqualsIgnoreCase(region.name, given.region);
    };
    if (std::ranges::any_of(model.regions, is_its)) continue;
    return Differs(absl::StrCat("a material is given for the region \"", given.region,
                                "\", which the model does not have"));
  }
  material.regions = std::move(matched);
  return absl::OkStatus();
}

/// Returns the parts of the energies of each region of the model.
std::vector<EnergyParts> EnergyPartsOf(const ModalModel& model) {
  std::vector<EnergyParts> parts;
  parts.reserve(model.regions.size());
  for (const ModelRegion& region : model.regions) {
    parts.push_back({region.strain_energy_parts, region.kinetic_energy_parts});
  }
  return parts;
}

absl::Status OutOfRange(absl::string_view what, double value, double least, double most) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
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
  if (properties.pose) RETURN_IF_ERROR(Validate(*properties.pose));
  if (!model.regions.empty()) return absl::OkStatus();  // each region has its ratio
  const double wanted = properties.poisson_ratio.value_or(model.poisson_ratio);
  const bool has_slopes = !model.poisson_slopes.empty();
  if (ServesPoissonRatio(model.poisson_ratio, wanted, has_slopes)) return absl::OkStatus();
  absl::Status status = Refusal(
      absl::StatusCode::kFailedPrecondition, "POISSON_RATIO_DIFFERS",
      absl::StrCat(
          "the material's Poisson's ratio is ", wanted, " but the modal model was computed for ",
          model.poisson_ratio, has_slopes ? ", which is too far away" : "",
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
                   " ms; change size, stiffness or damping; a free body with a stored transfer "
                   "(CreateTransfer) sounds by its acceleration alone"));
  AddFigure(status, "first_mode_hz", absl::StrCat(first_hz));
  return status;
}

Radiation RadiationOf(const Transfer* transfer) {
  if (transfer == nullptr) return {};
  return {.power_integrals = transfer->power_integrals,
          .air_density_kg_per_m3 = transfer->air_density_kg_per_m3,
          .sound_speed_m_per_s = transfer->sound_speed_m_per_s};
}

/// Returns the directivity of an object that is heard through `voice`, or nothing if the object
/// radiates equally in all directions.
std::optional<HeardDirectivity> DirectivityOf(const std::shared_ptr<const Transfer>& transfer,
                                              const Voice* voice, double size) {
  if (transfer == nullptr || voice == nullptr || !voice->hearing().directivity) return std::nullopt;
  return HeardDirectivity{.directivity = {.first = transfer->first,
                                          .harmonics = transfer->harmonics,
                                          .pattern_re = transfer->pattern_re,
                                          .pattern_im = transfer->pattern_im,
                                          .center_m = transfer->center_m,
                                          .radius_m = transfer->radius_m,
                                          .owner = transfer},
                          .size = size,
                          .sound_speed_m_per_s = transfer->sound_speed_m_per_s,
                          .near_field = voice->hearing().near_field};
}

/// Returns whether the acceleration of the body sounds, too, and not only its modes.
bool Clicks(const Transfer* transfer, const ObjectProperties& properties) {
  return transfer != nullptr && transfer->rigid &&
         properties.radiation != RadiationModel::kModesOnly;
}

/// Returns the body whose acceleration sounds, or nothing if only its modes sound.
std::optional<MovedBody> MovedBodyOf(const Transfer* transfer, const SoundingBody& body,
                                     const ObjectProperties& properties) {
  if (!Clicks(transfer, properties)) return std::nullopt;
  return MovedBody{.body = *transfer->rigid,
                   .density_kg_per_m3 = properties.material.density_kg_per_m3,
                   .size = properties.material.size,
                   .vertices = body.model->vertices,
                   .owner = body.model,
                   .air_density_kg_per_m3 = transfer->air_density_kg_per_m3,
                   .sound_speed_m_per_s = transfer->sound_speed_m_per_s};
}

/// Returns the frequency up to which the model is complete, or nothing if it is complete up to
/// `top_hz`.
std::optional<double> CompleteTo(const ModalModel& model, const SoundingMaterial& material,
                                 double top_hz) {
  const double complete_hz = NaturalFrequencyHz(model.complete_to_eigenvalue, material);
  // Relative difference that rounding makes between two computations of the same limit.
  constexpr double kRounding = 1e-6;
  if (complete_hz >= top_hz * (1 - kRounding)) return std::nullopt;
  return complete_hz;
}

/// Returns the eigenvalues of the model for the Poisson's ratio of an object, mode by mode; they
/// may cross each other.
std::vector<double> EigenvaluesFor(const ModalModel& model, const ObjectProperties& properties) {
  std::vector<double> eigenvalues = model.eigenvalues;
  const double poisson_ratio = PoissonRatioOf(model, properties);
  if (model.poisson_slopes.empty() || poisson_ratio == model.poisson_ratio) return eigenvalues;
  for (size_t m = 0; m < eigenvalues.size(); ++m) {
    eigenvalues[m] *= EigenvalueChange(model.poisson_slopes[m], model.poisson_ratio, poisson_ratio);
  }
  return eigenvalues;
}

/// Returns the modes with which an object sounds. A small hard body whose modes are all too high to
/// be heard may still click. Errors: FailedPrecondition (NO_MODE_IN_BAND).
absl::StatusOr<SoundingModes> SelectModes(const ModalModel& model,
                                          const ObjectProperties& properties,
                                          const Transfer* transfer, double sample_rate_hz,
                                          const SoundingBand& band) {
  const std::vector<double> eigenvalues = EigenvaluesFor(model, properties);
  const ModeTable table{eigenvalues, model.couplings, RadiationOf(transfer), EnergyPartsOf(model)};
  SoundingModes sounding = SelectSoundingModes(table, properties.material, sample_rate_hz, band);
  if (!sounding.modes.empty() || Clicks(transfer, properties)) return sounding;
  return NoModeInBand(model, properties.material, band);
}

std::shared_ptr<const YieldingModes> YieldingModesOf(const SoundingModes& sounding) {
  auto yielding = std::make_shared<YieldingModes>();
  yielding->shape_scale = sounding.shape_scale;
  yielding->modes.reserve(sounding.modes.size());
  for (const SoundingMode& mode : sounding.modes) {
    yielding->modes.push_back({.column = mode.column,
                               .damped_rad_per_s = static_cast<float>(mode.damped_rad_per_s),
                               .decay_rate_per_s = static_cast<float>(mode.decay_rate_per_s)});
  }
  return yielding;
}

double LowestHz(const std::vector<SoundingMode>& modes) {
  if (modes.empty()) return 0;
  return std::ranges::min(modes, {}, &SoundingMode::natural_frequency_hz).natural_frequency_hz;
}

double HighestHz(const std::vector<SoundingMode>& modes) {
  if (modes.empty()) return 0;
  return std::ranges::max(modes, {}, &SoundingMode::natural_frequency_hz).natural_frequency_hz;
}

}  // namespace

double PoissonRatioOf(const ModalModel& model, const ObjectProperties& properties) {
  const double stated = properties.poisson_ratio.value_or(model.poisson_ratio);
  return ServesPoissonRatio(model.poisson_ratio, stated, false) ? model.poisson_ratio : stated;
}

absl::StatusOr<std::shared_ptr<const Transfer>> ChooseTransfer(const ModalModel& model,
                                                               const ObjectProperties& properties,
                                                               TransferStore* transfers) {
  if (properties.radiation == RadiationModel::kPaperCoupling) return nullptr;
  const SoundingMaterial& material = properties.material;
  const double speed_m_per_s = std::sqrt(material.young_pa / material.density_kg_per_m3);
  auto transfer = transfers == nullptr ? nullptr : transfers->Find(model, speed_m_per_s);
  if (transfer != nullptr || properties.radiation == RadiationModel::kDefault) return transfer;
  return Refusal(absl::StatusCode::kFailedPrecondition, "TRANSFER_NOT_FOUND",
                 absl::StrCat("no transfer is stored of modalModels/", model.digest,
                              " for a material in which sound travels at ", speed_m_per_s,
                              " m/s: compute it first (CreateTransfer, carillon transfer --wait)"));
}

absl::Status CheckSounds(const ModalModel& model, const ObjectProperties& asked,
                         double sample_rate_hz, TransferStore* transfers) {
  ObjectProperties properties = asked;
  RETURN_IF_ERROR(MatchRegions(model, properties.material));
  RETURN_IF_ERROR(Check(model, properties));
  ASSIGN_OR_RETURN(const auto transfer, ChooseTransfer(model, properties, transfers));
  return SelectModes(model, properties, transfer.get(), sample_rate_hz, {}).status();
}

absl::StatusOr<SoundingObject> MakeSoundingObject(std::shared_ptr<const SoundingBody> body,
                                                  const ObjectProperties& asked,
                                                  const MixerBus& output,
                                                  std::shared_ptr<Voice> voice,
                                                  TransferStore* transfers,
                                                  const std::shared_ptr<const Transfer>* chosen) {
  const ModalModel& model = *body->model;
  ObjectProperties properties = asked;
  RETURN_IF_ERROR(MatchRegions(model, properties.material));
  RETURN_IF_ERROR(Check(model, properties));
  const MixerSettings& settings = output.mixer.settings();
  std::shared_ptr<const Transfer> transfer;
  if (chosen != nullptr) {
    transfer = *chosen;
  } else {
    ASSIGN_OR_RETURN(transfer, ChooseTransfer(model, properties, transfers));
  }
  auto directivity = DirectivityOf(transfer, voice.get(), properties.material.size);
  const SoundingBand band{.directed = directivity.has_value()};
  ASSIGN_OR_RETURN(const SoundingModes sounding,
                   SelectModes(model, properties, transfer.get(), settings.sample_rate_hz, band));
  auto oscillators = std::make_unique<OscillatorBank>(
      sounding, body->shapes,
      OscillatorBankSettings{.sample_rate_hz = settings.sample_rate_hz,
                             .block_frame_count = settings.block_frame_count,
                             .gain = properties.gain * kFullScalePa / settings.full_scale_pa,
                             .directivity = std::move(directivity),
                             .moved = MovedBodyOf(transfer.get(), *body, properties)});
  ASSIGN_OR_RETURN(const BankId bank, output.mixer.Add(std::move(oscillators), voice, output.bus));
  const bool clicks = Clicks(transfer.get(), properties);
  const double top_hz = std::min(band.highest_hz, settings.sample_rate_hz / 2);
  return SoundingObject{.body = std::move(body),
                        .properties = properties,
                        .yielding = YieldingModesOf(sounding),
                        .mode_count = static_cast<uint32_t>(sounding.modes.size()),
                        .lowest_frequency_hz = LowestHz(sounding.modes),
                        .highest_frequency_hz = HighestHz(sounding.modes),
                        .complete_to_hz = CompleteTo(model, properties.material, top_hz),
                        .bank = bank,
                        .bus = output.bus,
                        .voice = std::move(voice),
                        .clicks = clicks,
                        .transfer = std::move(transfer)};
}

}  // namespace carillon
