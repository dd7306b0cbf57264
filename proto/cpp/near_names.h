// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Returns the names with the least edit distance to `written`, ignoring case. The distance of a
/// name with underscores is that of the whole name or of its closest word. Returns no names if more
/// than a third of the letters differ.
std::vector<std::string> NearNames(std::string_view written, std::span<const std::string> names);

/// Returns `REASON: no KIND is named "NAME"` as an InvalidArgument, with the nearest of the known
/// names. The figure "nearest" has the first of these, and "names" all known ones, separated by
/// commas. `known` is not empty.
absl::Status UnknownName(absl::string_view reason, absl::string_view kind, const std::string& name,
                         std::span<const std::string> known);

}  // namespace carillon
