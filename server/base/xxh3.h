// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace carillon {

/// The 64-bit XXH3 hash with seed 0, which is stored with every chunk of the database.
uint64_t Xxh3(std::string_view bytes);

}  // namespace carillon
