// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// The rules of v1::DecompositionSettings, in one place for the daemon and for carillon-precompute.

/// Gives absent fields their default values. Poisson's ratio, which belongs to a material, has
/// none.
void FillInDefaults(v1::DecompositionSettings& settings);

/// Checks settings that FillInDefaults has completed. Errors: InvalidArgument (INVALID_SETTINGS;
/// the message names the field, its value and its range).
absl::Status CheckSettings(const v1::DecompositionSettings& settings);

/// The part of a modal model's name that the settings determine: one line "key value" for each
/// setting, in a fixed order. Two models of one mesh file are the same exactly if these texts are.
///
///     poisson_1e-4 <Poisson's ratio in units of 1e-4, an integer>
///     element <linear|quadratic>
///     mass <lumped|consistent>
///     metres_per_unit <shortest decimal that reads back as the same double>
///     keep_surface <auto|yes|no>
///     target_node_count <integer; 0: decided from the surface>
///
/// Settings that were added later have a line only where they differ from their default value, so
/// that no older model changes its name; SettingsText lists them.
std::string SettingsText(const v1::DecompositionSettings& settings);

/// Poisson's ratio rounded to the steps of 1e-4 that name a model.
double RoundedPoissonRatio(double poisson_ratio);

inline constexpr int kMaxKeptModeCount = 5000;  ///< the limit of keep_mode_count

}  // namespace carillon
