// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace carillon {

/// The first letters of UTF-8 text that fit into `max_bytes`. A letter that is cut at the end is
/// left out: protobuf refuses a message with half a letter in it, and so a whole list of models.
std::string WholeLetters(std::string_view text, size_t max_bytes);

}  // namespace carillon
