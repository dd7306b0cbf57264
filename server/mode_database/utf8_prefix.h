// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace carillon {

/// The first characters of UTF-8 text that fit into `max_bytes`. A character that is cut at the end
/// is left out: protobuf refuses a message with half a character in it, and so a whole list of
/// models.
std::string Utf8Prefix(std::string_view text, size_t max_bytes);

}  // namespace carillon
