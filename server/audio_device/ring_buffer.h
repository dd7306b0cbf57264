// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

namespace carillon {

/// A ring buffer that carries plain values (samples, numbers) from one thread to another. Values
/// are copied in runs, without locks.
template <typename T>
class RingBuffer {
 public:
  explicit RingBuffer(size_t capacity) : values_(capacity) {}

  size_t capacity() const { return values_.size(); }

  /// Called by the producer: number of values that may be pushed.
  size_t free_count() const {
    return capacity() -
           (written_.load(std::memory_order_relaxed) - read_.load(std::memory_order_acquire));
  }

  /// Called by the producer: appends `values`, at most free_count() of them.
  void Push(std::span<const T> values) noexcept {
    const size_t written = written_.load(std::memory_order_relaxed);
    const size_t begin = written % capacity();
    const size_t first = std::min(values.size(), capacity() - begin);
    std::copy_n(values.data(), first, values_.data() + begin);
    std::copy_n(values.data() + first, values.size() - first, values_.data());
    written_.store(written + values.size(), std::memory_order_release);
  }

  /// Called by a producer that always appends the same number of values, of which the capacity is a
  /// multiple: the place of the next `count` values, at most free_count(). They are appended by
  /// Commit once they have been written there.
  std::span<T> Next(size_t count) noexcept {
    const size_t begin = written_.load(std::memory_order_relaxed) % capacity();
    assert(begin + count <= capacity());
    return std::span(values_).subspan(begin, count);
  }

  void Commit(size_t count) noexcept {
    written_.store(written_.load(std::memory_order_relaxed) + count, std::memory_order_release);
  }

  /// Called by the consumer: moves up to values.size() values to the front of `values`; returns
  /// their number.
  size_t Pop(std::span<T> values) noexcept {
    const size_t read = read_.load(std::memory_order_relaxed);
    const size_t count = std::min(values.size(), written_.load(std::memory_order_acquire) - read);
    const size_t begin = read % capacity();
    const size_t first = std::min(count, capacity() - begin);
    std::copy_n(values_.data() + begin, first, values.data());
    std::copy_n(values_.data(), count - first, values.data() + first);
    read_.store(read + count, std::memory_order_release);
    return count;
  }

 private:
  std::vector<T> values_;
  alignas(64) std::atomic<size_t> written_{0};
  alignas(64) std::atomic<size_t> read_{0};
};

}  // namespace carillon
