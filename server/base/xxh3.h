// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace carillon {

/// XXH3, 64 bits, seed 0: the hash beside every stored chunk.
uint64_t Xxh3(std::string_view bytes);

}  // namespace carillon
