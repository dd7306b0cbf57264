// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// This file has the rules of v1::DecompositionSettings for the daemon and for carillon-precompute.

/// Gives absent fields their default values. Poisson's ratio has no default, because it belongs to
/// a material; metres_per_unit stays zero, because a large body needs a unit that somebody stated.
void FillInDefaults(v1::DecompositionSettings& settings);

/// Checks settings that FillInDefaults has completed. Errors: InvalidArgument (INVALID_SETTINGS;
/// the message names the field, its value and its range).
absl::Status CheckSettings(const v1::DecompositionSettings& settings);

/// Returns the length of one unit of the mesh file, m: 1 unless the settings state another.
double MetresPerUnit(const v1::DecompositionSettings& settings);

/// Returns the text of the settings, from which a modal model's name is made. It has one line "key
/// value" for each setting, in a fixed order. Two models of one mesh file are the same exactly if
/// these texts are equal.
///
///     poisson_1e-4 <Poisson's ratio in units of 1e-4, an integer>
///     element <linear|quadratic>
///     mass <lumped|consistent>
///     metres_per_unit <shortest decimal that reads back as the same double>
///     keep_surface <auto|yes|no>
///     target_node_count <integer; 0 if decided from the surface>
///
/// Settings that were added later have a line only if they differ from their default value, so that
/// no older model changes its name. The code of SettingsText lists these settings.
std::string SettingsText(const v1::DecompositionSettings& settings);

/// Returns Poisson's ratio, rounded to 1e-4 as in the name of a model.
double RoundedPoissonRatio(double poisson_ratio);

inline constexpr int kMaxKeptModeCount = 5000;  ///< the limit of keep_mode_count

}  // namespace carillon
