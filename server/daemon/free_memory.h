// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// Bounds the freed memory that the allocator keeps. Must be called before the first thread starts.
/// It starts the program of this process once more, with the arguments `argv`.
///
/// By default glibc raises its thresholds with each large array that is freed, until each arena
/// keeps 64 MiB, and makes eight arenas for each core, between which clients that come and go
/// spread small blocks. The thresholds stay fixed here, and each core has one arena.
///
/// By default each thread also keeps up to 448 freed blocks in a cache that nothing empties. Over
/// hours, these blocks hold back ever more pages. The caches are turned off by GLIBC_TUNABLES,
/// which glibc reads only at the start of a program. A value that the operator has set for
/// glibc.malloc.tcache_count is kept.
void BoundFreeMemory(char* const* argv);

/// Gives freed memory back to the system. By itself, glibc does not return free pages that lie
/// below a small block in use.
void ReturnFreeMemory();

}  // namespace carillon
