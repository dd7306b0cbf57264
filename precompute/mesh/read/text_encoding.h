// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace carillon::precompute {

/// The UTF-8 text of bytes that are UTF-16 text with a byte order mark, as editors and old
/// exporters write them on Windows. Nothing for all other bytes, and for damaged UTF-16.
std::optional<std::string> Utf8OfUtf16(std::string_view bytes);

}  // namespace carillon::precompute
