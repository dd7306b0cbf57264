// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

namespace carillon::precompute {

/// SHA-256 of some bytes, lower-case hexadecimal.
std::string Sha256Hex(const std::string& bytes);

}  // namespace carillon::precompute
