// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "proto/cpp/loss_factor.h"

namespace carillon {

/// The named materials of proto/materials.textproto.
const v1::MaterialCatalogue& Materials();

/// A material with every figure present and no preset: `material` over the preset that it names.
/// Damping of either law replaces the loss factor of the preset.
/// Checks that the figures are finite and within the ranges that material.proto states.
/// Errors: InvalidArgument, its message beginning "UNKNOWN_MATERIAL: " (no such preset; the message
/// lists the presets, the nearest first) or "INVALID_MATERIAL: " (a figure missing or out of
/// range). The Poisson's ratio may stay absent where neither gives it.
absl::StatusOr<v1::Material> ResolveMaterial(const v1::Material& material);

std::vector<LossFactorPoint> LossFactorOf(const v1::Material& material);
void SetLossFactor(std::span<const LossFactorPoint> points, v1::Material& material);

/// (alpha1 omega^2 + alpha2 + eta omega)/2, 1/s, of a mode of this natural frequency omega/(2 pi).
double DecayRatePerS(const v1::Material& resolved, double natural_frequency_hz);

}  // namespace carillon
