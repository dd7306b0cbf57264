// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>

namespace carillon {

/// Lets the process outlive the truncation of a file that is mapped into its memory. An access
/// beyond the end of such a file raises SIGBUS. A MappingGuard then puts a page of zeros in the
/// place of the missing one, and remembers that.
class MappingGuard {
 public:
  MappingGuard() = default;
  /// Guards nothing any more. The mappings must not be used afterwards.
  ~MappingGuard() { Release(); }
  MappingGuard(const MappingGuard&) = delete;
  MappingGuard& operator=(const MappingGuard&) = delete;

  /// Guards the bytes of a mapping from now on, if fewer than 256 mappings of the process are
  /// guarded. Does nothing if this mapping is guarded already. The first call in a process handles
  /// SIGBUS from then on.
  void Guard(volatile void* begin, size_t byte_count);

  /// Guards nothing any more.
  void Release();

  /// Whether a page was missing.
  bool was_truncated() const { return was_truncated_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> was_truncated_{false};
};

}  // namespace carillon
