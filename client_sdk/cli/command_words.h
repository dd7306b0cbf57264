// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "absl/strings/string_view.h"

namespace carillon::cli {

/// Whether a command has an option, such as "--tail".
using HasOption = std::function<bool(const std::string& option)>;

/// An answer for `carillon model create`, which has an option for each field of a decomposition.
inline bool HasEveryOption(const std::string& /*option*/) { return true; }

/// Returns a message of the daemon in which commands and options of `carillon` replace the calls
/// and fields of the contract. A field for which the command has no option stays, for example a
/// field of a trace. Words that are quoted or belong to a path stay, too.
std::string InCommandWords(absl::string_view message, const HasOption& has_option);

}  // namespace carillon::cli
