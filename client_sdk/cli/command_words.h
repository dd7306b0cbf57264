// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "absl/strings/string_view.h"

namespace carillon::cli {

/// Whether a command has an option, such as "--tail".
using HasOption = std::function<bool(const std::string& option)>;

/// For `carillon model create`, which has all options that the words of a decomposition name.
inline bool HasEveryOption(const std::string& /*option*/) { return true; }

/// Returns a message of the daemon with the commands and options of `carillon` in the place of the
/// calls and fields of the contract. Fields stay where the command has no option for them, for
/// example those of a trace, and so do words that are quoted or belong to a path.
std::string InCommandWords(absl::string_view message, const HasOption& has_option);

}  // namespace carillon::cli
