// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// This file has the rules for the regions of a body of several materials. Names of regions are
/// compared without regard to the case of letters.

/// Adds "REGION=NAME", a named material for each region, to `material`, whose own figures become
/// those of all other regions.
void AddRegions(const std::vector<std::string>& texts, v1::Material& material);

/// Returns the material of a region, or that of all others, or null if there is neither.
const v1::Material* FindRegion(const v1::Material& material, absl::string_view region);

/// Sets the regions of the settings from a resolved material. A material without Poisson's ratio
/// gets that of the settings.
void SetRegions(const v1::Material& resolved, v1::DecompositionSettings& settings);

/// Checks the regions of settings. Errors: InvalidArgument (INVALID_SETTINGS).
absl::Status CheckRegions(const v1::DecompositionSettings& settings);

/// Returns a resolved material with one entry for each region of the model, in the model's order,
/// and with the model's reference as its figures. With the material of a model without regions it
/// returns just that. Errors: InvalidArgument (REGION_MATERIAL_DIFFERS: a region has no material,
/// the factors by which the materials of two regions differ from the model's are not the same, or
/// the material has regions and the model has none).
absl::StatusOr<v1::Material> MatchRegions(const v1::ModalModelHeader& header,
                                          const v1::Material& resolved);

/// Returns the decay rate that the damping of one region gives a mode, 1/s: (alpha1 omega^2 + eta
/// omega)/2 times the region's part of the mode's strain energy, and alpha2/2 times its part of the
/// kinetic energy.
double RegionDecayRatePerS(const v1::Material& material, double natural_frequency_hz,
                           double strain_part, double kinetic_part);

/// Returns the decay rate that the damping of a material of MatchRegions gives a mode, 1/s. In a
/// body of several materials it is the sum over its regions.
double DecayRatePerS(const v1::ModalModelHeader& header, const v1::Material& matched, int mode,
                     double natural_frequency_hz);

}  // namespace carillon
