// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace carillon {

/// The names with the least edit distance to `written`, ignoring case. The distance of a name with
/// underscores is that of its closest word. Empty if more than a third of the letters differ.
std::vector<std::string> NearNames(std::string_view written, std::span<const std::string> names);

}  // namespace carillon
