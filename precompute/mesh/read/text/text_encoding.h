// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace carillon::precompute {

/// Returns the bytes without the byte order mark of UTF-8 with which editors on Windows begin
/// texts.
std::string_view WithoutByteOrderMark(std::string_view bytes);

/// Converts UTF-16 text with a byte order mark, which editors and old exporters write on Windows,
/// to UTF-8. Returns nothing if the bytes are any other text or damaged UTF-16.
std::optional<std::string> Utf8OfUtf16(std::string_view bytes);

}  // namespace carillon::precompute
