// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>

namespace carillon {

/// An allocator for arrays of many megabytes that are filled once and read at random. Arrays of 2
/// MiB and more lie in huge pages: each page of 4 KiB would cost a page fault when it is filled,
/// and most reads a page-table walk. A vector's resize() leaves new numbers uninitialized.
template <typename T>
class LargeAllocator {
 public:
  using value_type = T;

  LargeAllocator() = default;
  template <typename U>
  LargeAllocator(const LargeAllocator<U>&) {}  // NOLINT: allocators convert implicitly

  /// Memory is aligned to a cache line at least.
  T* allocate(size_t count) {
    const size_t wanted = count * sizeof(T);
    const size_t alignment = wanted < kHugePageBytes ? kLineBytes : kHugePageBytes;
    const size_t bytes = (wanted + alignment - 1) / alignment * alignment;
    void* const memory = std::aligned_alloc(alignment, bytes);
    if (memory == nullptr) throw std::bad_alloc();
#if defined(MADV_HUGEPAGE)
    if (alignment == kHugePageBytes) madvise(memory, bytes, MADV_HUGEPAGE);
#endif
    return static_cast<T*>(memory);
  }

  void deallocate(T* memory, size_t) noexcept { std::free(memory); }

  template <typename U, typename... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    if constexpr (sizeof...(Arguments) == 0) {
      ::new (static_cast<void*>(at)) U;
    } else {
      ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
  }

  bool operator==(const LargeAllocator&) const = default;

 private:
  static constexpr size_t kLineBytes = 64;
  static constexpr size_t kHugePageBytes = size_t{1} << 21;
};

}  // namespace carillon
