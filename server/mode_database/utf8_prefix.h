// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace carillon {

/// Returns the first characters of UTF-8 text that fit into `max_bytes`. A character of which only
/// a part would fit is left out. Protobuf refuses a whole message, for example a list of models, if
/// one of its texts ends in the middle of a character.
std::string Utf8Prefix(std::string_view text, size_t max_bytes);

}  // namespace carillon
