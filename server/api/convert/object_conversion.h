// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/radiation.pb.h"
#include "carillon/v1/scene_service.pb.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/pose_conversion.h"
#include "server/api/convert/resource_name.h"
#include "server/mode_database/model_store.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Resolves a material to its figures, and fills in the defaults: a size of zero and an absent gain
/// become 1. Errors: those of ResolveMaterial.
absl::StatusOr<ObjectProperties> ToObjectProperties(const v1::Material& material, double size,
                                                    std::optional<double> gain);

/// Returns the material of an object of the model with this digest, which is `asked` or, if `asked`
/// is empty, the model's own material. Errors: InvalidArgument (INVALID_MATERIAL: the model has no
/// material).
absl::StatusOr<v1::Material> MaterialOrModels(const v1::Material& asked, const std::string& digest,
                                              ModelStore& models);

RadiationModel FromProto(v1::RadiationModel radiation);

/// A model and the properties of an object that sounds with it.
struct ObjectOfModel {
  std::shared_ptr<const ModalModel> model;
  ObjectProperties properties;
};

/// Returns the object that a request or a record of a trace describes. Both have fields with the
/// same names. Errors: those of ParseModelName, MaterialOrModels, ToObjectProperties and
/// ModelStore::FindToSound.
template <typename Message>
absl::StatusOr<ObjectOfModel> ToObject(const Message& message, ModelStore& models) {
  ASSIGN_OR_RETURN(const std::string digest, ParseModelName(message.modal_model()));
  ASSIGN_OR_RETURN(const v1::Material material,
                   MaterialOrModels(message.material(), digest, models));
  const auto gain = message.has_gain() ? std::optional<double>(message.gain()) : std::nullopt;
  ObjectOfModel object;
  ASSIGN_OR_RETURN(object.properties, ToObjectProperties(material, message.size(), gain));
  if (message.has_pose()) object.properties.pose = FromProto(message.pose());
  object.properties.radiation = FromProto(message.radiation());
  ASSIGN_OR_RETURN(object.model, models.FindToSound(digest));
  return object;
}

/// Converts the change of an object. Errors: those of ResolveMaterial.
absl::StatusOr<ObjectChange> ToObjectChange(const v1::UpdateObjectRequest& request);

/// Converts an object. `scene` is the name of its scene.
v1::SoundingObject ToProto(const std::string& scene, const PlacedObject& placed);

}  // namespace carillon
