// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace carillon {

/// Returns the first characters of UTF-8 text that fit into `max_bytes`. A character that does not
/// fit as a whole is left out, because protobuf refuses every message with half a character, such
/// as a list of models.
std::string Utf8Prefix(std::string_view text, size_t max_bytes);

}  // namespace carillon
