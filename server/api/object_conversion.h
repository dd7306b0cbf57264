// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/radiation.pb.h"
#include "carillon/v1/scene_service.pb.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Resolves a material to its figures, and fills in the defaults of size (zero: 1) and gain
/// (absent: 1). Errors: those of ResolveMaterial.
absl::StatusOr<ObjectProperties> ToObjectProperties(const v1::Material& material, double size,
                                                    std::optional<double> gain);

RadiationModel FromProto(v1::RadiationModel radiation);

/// Errors: those of ResolveMaterial.
absl::StatusOr<ObjectChange> ToObjectChange(const v1::UpdateObjectRequest& request);

v1::SoundingObject ToProto(uint64_t scene, const PlacedObject& placed);

}  // namespace carillon
