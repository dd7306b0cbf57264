// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace carillon {

/// The names closest to what was written by number of letters to change, add or leave out, in
/// either case; a name with underscores is as close as the closest of its words. None where more
/// than a third of the letters differ.
std::vector<std::string> NearNames(std::string_view written, std::span<const std::string> names);

}  // namespace carillon
