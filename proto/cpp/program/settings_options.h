// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/modal_model.pb.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon {

/// The group of the options that AddSettingsOptions adds.
inline constexpr char kSettingsGroup[] = "Decomposition";

/// Adds an option for every field of the settings except Poisson's ratio and the regions, which the
/// options of materials set. Parsing writes into `settings`, which must outlive `app`. A text that
/// is no value of the field throws CLI::ValidationError.
void AddSettingsOptions(CLI::App& app, v1::DecompositionSettings& settings);

}  // namespace carillon
