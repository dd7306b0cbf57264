// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace carillon {

/// Returns how much memory the daemon has allocated and not freed, or zero with another allocator
/// than jemalloc, as a sanitizer brings one.
uint64_t AllocatedBytes();

/// Gives memory that was freed more than a second ago back to the system.
void GiveMemoryBack();

}  // namespace carillon
