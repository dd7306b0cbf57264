// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"

namespace carillon {

/// The named materials of proto/materials.textproto.
const v1::MaterialCatalogue& Materials();

/// A material with every figure present and no preset: `material` over the preset that it names.
/// Checks that the figures are finite and within the ranges that material.proto states.
/// Errors: InvalidArgument, its message beginning "UNKNOWN_MATERIAL: " (no such preset; the message
/// lists the presets) or "INVALID_MATERIAL: " (a figure missing or out of range). The Poisson's
/// ratio may stay absent where neither gives it.
absl::StatusOr<v1::Material> ResolveMaterial(const v1::Material& material);

}  // namespace carillon
