// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace carillon {

/// Returns the text with each byte in hexadecimal, such as "\x1b", that a terminal would act on,
/// that changes the direction of the text after it, or that is not UTF-8.
std::string EscapedText(std::string_view text);

/// Returns the text between quotation marks as an error may show a word of somebody's file: escaped
/// as above, and cut after 60 bytes.
std::string QuotedText(std::string_view text);

}  // namespace carillon
