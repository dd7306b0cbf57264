// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <semaphore>
#include <thread>

namespace carillon {

/// Bounds what the allocator keeps of freed memory. Must be called before the first thread starts.
///
/// glibc raises its thresholds with each large array that is freed, up to 64 MiB kept for each
/// arena, and a rendering frees many.
void BoundFreeMemory();

/// Gives freed memory back to the system every few seconds, on a thread of its own. An arena's free
/// pages below a small block that is still in use do not go back by themselves.
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
