// SPDX-License-Identifier: Apache-2.0
#include "server/free_memory.h"

#include <malloc.h>

#include <algorithm>
#include <thread>

namespace carillon {
namespace {

/// Larger blocks have pages of their own, which go back as soon as the block is freed.
constexpr int kOwnPagesBytes = 256 << 10;
/// Free memory that stays at the end of an arena.
constexpr int kKeptBytes = 1 << 20;

}  // namespace

void BoundFreeMemory() {
  mallopt(M_MMAP_THRESHOLD, kOwnPagesBytes);
  mallopt(M_TRIM_THRESHOLD, kKeptBytes);
  mallopt(M_ARENA_MAX, static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

void ReturnFreeMemory() { malloc_trim(kKeptBytes); }

}  // namespace carillon
