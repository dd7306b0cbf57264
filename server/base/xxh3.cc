// SPDX-License-Identifier: Apache-2.0
#include "server/base/xxh3.h"

#include <xxhash.h>

namespace carillon {

uint64_t Xxh3(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

}  // namespace carillon
