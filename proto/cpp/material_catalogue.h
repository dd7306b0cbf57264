// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "proto/cpp/loss_factor.h"

namespace carillon {

/// Returns the named materials of proto/materials.textproto.
const v1::MaterialCatalogue& Materials();

/// Returns a material with every figure present and no preset. Figures of `material` override those
/// of the preset that it names. Damping of either law replaces the loss factor of the preset.
/// Poisson's ratio stays absent if neither has it. Regions come back in alphabetical order, an
/// empty name first, which stands for all other regions. The figures outside the regions are those
/// of the first one, except a Young's modulus and a density that are given. Checks that the figures
/// are finite and within the ranges that material.proto states. Errors: InvalidArgument, with a
/// message that begins "UNKNOWN_MATERIAL: " (no such preset; as UnknownName makes it) or
/// "INVALID_MATERIAL: " (a figure is missing or out of range).
absl::StatusOr<v1::Material> ResolveMaterial(const v1::Material& material);

std::vector<LossFactorPoint> LossFactorOf(const v1::Material& material);
void SetLossFactor(std::span<const LossFactorPoint> points, v1::Material& material);

/// Returns (alpha1 omega^2 + alpha2 + eta omega)/2, 1/s, which is the decay rate of a mode of
/// natural frequency omega/(2 pi).
double DecayRatePerS(const v1::Material& resolved, double natural_frequency_hz);

}  // namespace carillon
