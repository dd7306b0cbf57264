// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/object_conversion.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/pose_conversion.h"
#include "server/api/convert/resource_name.h"

namespace carillon {
namespace {

std::optional<double> PoissonRatio(const v1::Material& resolved) {
  if (!resolved.has_poisson_ratio()) return std::nullopt;
  return resolved.poisson_ratio();
}

RegionMaterial ToRegionMaterial(const std::string& region, const v1::Material& resolved) {
  return {.region = region,
          .young_pa = resolved.young_pa(),
          .density_kg_per_m3 = resolved.density_kg_per_m3(),
          .poisson_ratio = PoissonRatio(resolved),
          .damping = {.alpha1_s = resolved.alpha1_s(),
                      .alpha2_per_s = resolved.alpha2_per_s(),
                      .loss_factor = LossFactorOf(resolved)}};
}

std::vector<RegionMaterial> RegionsOf(const v1::Material& resolved) {
  std::vector<RegionMaterial> regions;
  regions.reserve(static_cast<size_t>(resolved.regions_size()));
  for (const v1::RegionMaterial& entry : resolved.regions()) {
    regions.push_back(ToRegionMaterial(entry.region(), entry.material()));
  }
  return regions;
}

SoundingMaterial ToSoundingMaterial(const v1::Material& resolved, double size) {
  return {.young_pa = resolved.young_pa(),
          .density_kg_per_m3 = resolved.density_kg_per_m3(),
          .alpha1_s = resolved.alpha1_s(),
          .alpha2_per_s = resolved.alpha2_per_s(),
          .size = size,
          .loss_factor = LossFactorOf(resolved),
          .regions = RegionsOf(resolved)};
}

v1::Material ToProto(const ObjectProperties& properties, double model_poisson_ratio) {
  v1::Material material;
  material.set_young_pa(properties.material.young_pa);
  material.set_poisson_ratio(properties.poisson_ratio.value_or(model_poisson_ratio));
  material.set_density_kg_per_m3(properties.material.density_kg_per_m3);
  material.set_alpha1_s(properties.material.alpha1_s);
  material.set_alpha2_per_s(properties.material.alpha2_per_s);
  SetLossFactor(properties.material.loss_factor, material);
  for (const RegionMaterial& region : properties.material.regions) {
    v1::RegionMaterial& entry = *material.add_regions();
    entry.set_region(region.region);
    v1::Material& of_region = *entry.mutable_material();
    of_region.set_young_pa(region.young_pa);
    of_region.set_density_kg_per_m3(region.density_kg_per_m3);
    if (region.poisson_ratio) of_region.set_poisson_ratio(*region.poisson_ratio);
    of_region.set_alpha1_s(region.damping.alpha1_s);
    of_region.set_alpha2_per_s(region.damping.alpha2_per_s);
    SetLossFactor(region.damping.loss_factor, of_region);
  }
  return material;
}

v1::RadiationModel RadiationOf(const SoundingObject& object) {
  if (object.transfer == nullptr) return v1::RADIATION_MODEL_PAPER_COUPLING;
  return object.properties.radiation == RadiationModel::kModesOnly
             ? v1::RADIATION_MODEL_MODES_ONLY
             : v1::RADIATION_MODEL_RADIATED_POWER;
}

}  // namespace

absl::StatusOr<ObjectProperties> ToObjectProperties(const v1::Material& material, double size,
                                                    std::optional<double> gain) {
  ASSIGN_OR_RETURN(const v1::Material resolved, ResolveMaterial(material));
  return ObjectProperties{.material = ToSoundingMaterial(resolved, size == 0 ? 1 : size),
                          .poisson_ratio = PoissonRatio(resolved),
                          .gain = gain.value_or(1)};
}

absl::StatusOr<v1::Material> MaterialOrModels(const v1::Material& asked, const std::string& digest,
                                              ModelStore& models) {
  if (asked.ByteSizeLong() > 0) return asked;
  ASSIGN_OR_RETURN(const std::optional<v1::Material> remembered, models.Material(digest));
  if (remembered.has_value()) return *remembered;
  // If the model does not exist, this error is returned, and not the one below.
  RETURN_IF_ERROR(models.Summary(digest).status());
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                 absl::StrCat(ModelName(digest),
                              " was not made with a material here: name one for the object, or set "
                              "the model's (UpdateModalModel, carillon model tag --material)"));
}

RadiationModel FromProto(v1::RadiationModel radiation) {
  switch (radiation) {
    case v1::RADIATION_MODEL_PAPER_COUPLING:
      return RadiationModel::kPaperCoupling;
    case v1::RADIATION_MODEL_RADIATED_POWER:
      return RadiationModel::kRadiatedPower;
    case v1::RADIATION_MODEL_MODES_ONLY:
      return RadiationModel::kModesOnly;
    default:
      return RadiationModel::kDefault;
  }
}

absl::StatusOr<ObjectChange> ToObjectChange(const v1::UpdateObjectRequest& request) {
  ObjectChange change;
  if (request.has_material()) {
    ASSIGN_OR_RETURN(const v1::Material resolved, ResolveMaterial(request.material()));
    change.material = ToSoundingMaterial(resolved, 1);
    change.poisson_ratio = PoissonRatio(resolved);
  }
  if (request.has_size()) change.size = request.size();
  if (request.has_gain()) change.gain = request.gain();
  if (request.has_pose()) change.pose = FromProto(request.pose());
  if (request.radiation() != v1::RADIATION_MODEL_UNSPECIFIED) {
    change.radiation = FromProto(request.radiation());
  }
  change.glide_s = request.glide_s();
  return change;
}

v1::SoundingObject ToProto(const std::string& scene, const PlacedObject& placed) {
  const SoundingObject& object = placed.object;
  v1::SoundingObject proto;
  proto.set_name(absl::StrCat(scene, "/objects/", placed.handle));
  proto.set_handle(placed.handle);
  proto.set_modal_model(ModelName(object.body->model->digest));
  *proto.mutable_material() = ToProto(object.properties, object.body->model->poisson_ratio);
  proto.set_size(object.properties.material.size);
  proto.set_gain(object.properties.gain);
  proto.set_sounding_mode_count(object.mode_count);
  proto.set_lowest_frequency_hz(object.lowest_frequency_hz);
  proto.set_highest_frequency_hz(object.highest_frequency_hz);
  if (object.complete_to_hz) proto.set_complete_to_hz(*object.complete_to_hz);
  proto.set_radiation(RadiationOf(object));
  if (object.properties.pose) *proto.mutable_pose() = ToProto(*object.properties.pose);
  return proto;
}

}  // namespace carillon
