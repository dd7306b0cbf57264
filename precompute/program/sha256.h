// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

namespace carillon::precompute {

/// Returns the SHA-256 of `bytes` in lower-case hexadecimal digits.
std::string Sha256Hex(const std::string& bytes);

}  // namespace carillon::precompute
