// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/radiation.pb.h"
#include "carillon/v1/scene_service.pb.h"
#include "server/mode_database/model_store.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Resolves a material to its figures, and fills in the defaults of size (zero: 1) and gain
/// (absent: 1). Errors: those of ResolveMaterial.
absl::StatusOr<ObjectProperties> ToObjectProperties(const v1::Material& material, double size,
                                                    std::optional<double> gain);

/// The material of an object of the model with this digest: `asked`, or the model's own where
/// `asked` is empty. Errors: InvalidArgument (INVALID_MATERIAL: the model has none).
absl::StatusOr<v1::Material> MaterialOrModels(const v1::Material& asked, const std::string& digest,
                                              ModelStore& models);

RadiationModel FromProto(v1::RadiationModel radiation);

/// Errors: those of ResolveMaterial.
absl::StatusOr<ObjectChange> ToObjectChange(const v1::UpdateObjectRequest& request);

v1::SoundingObject ToProto(uint64_t scene, const PlacedObject& placed);

}  // namespace carillon
