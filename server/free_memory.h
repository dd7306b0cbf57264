// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// Bounds the freed memory that the allocator keeps. Must be called before the first thread starts.
///
/// By default glibc raises its thresholds with each large array that is freed, until each arena
/// keeps 64 MiB, and makes eight arenas for each core, between which clients that come and go
/// spread small blocks. The thresholds stay fixed here, and each core has one arena.
void BoundFreeMemory();

/// Gives freed memory back to the system. By itself, glibc does not return free pages that lie
/// below a small block in use.
void ReturnFreeMemory();

}  // namespace carillon
