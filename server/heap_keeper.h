// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <semaphore>
#include <thread>

namespace carillon {

/// Bounds the freed memory that the allocator keeps. Must be called before the first thread starts.
///
/// By default glibc raises its thresholds with each large array that is freed, until each arena
/// keeps 64 MiB, and makes eight arenas for each core, between which clients that come and go
/// spread small blocks. The thresholds stay fixed here, and each core has one arena.
void BoundFreeMemory();

/// Gives freed memory back to the system every few seconds, on a thread of its own. By itself,
/// glibc does not return free pages that lie below a small block in use.
class HeapKeeper {
 public:
  HeapKeeper();
  ~HeapKeeper();
  HeapKeeper(const HeapKeeper&) = delete;
  HeapKeeper& operator=(const HeapKeeper&) = delete;

 private:
  void Run();

  std::binary_semaphore stop_{0};
  std::thread thread_;
};

}  // namespace carillon
