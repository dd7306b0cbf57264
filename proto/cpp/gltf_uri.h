// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace carillon {

/// Returns the path of the file that a relative URI of a glTF in `folder` names, or nothing if the
/// URI names no file in that folder or below it. An untrusted glTF must not make a program read
/// other files.
std::optional<std::string> FileOfGltfUri(const std::string& folder, const std::string& uri);

}  // namespace carillon
