// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

namespace carillon {

/// The numbers of values that were ever pushed to and popped from a ring buffer.
struct RingCounts {
  alignas(64) std::atomic<size_t> written{0};
  alignas(64) std::atomic<size_t> read{0};
};

/// A ring buffer over memory that it does not own. It carries plain values (samples, numbers) from
/// one thread, or process, to another. Values are copied in runs, without locks.
template <typename T>
class RingView {
 public:
  RingView(std::span<T> values, RingCounts& counts) : values_(values), counts_(&counts) {}

  size_t capacity() const { return values_.size(); }

  /// Returns the number of values that may be pushed. Only the producer may call it.
  size_t free_count() const {
    return capacity() - (counts_->written.load(std::memory_order_relaxed) -
                         counts_->read.load(std::memory_order_acquire));
  }

  /// Appends `values`, at most free_count() of them. Only the producer may call it.
  void Push(std::span<const T> values) noexcept {
    const size_t written = counts_->written.load(std::memory_order_relaxed);
    const size_t begin = written % capacity();
    const size_t first = std::min(values.size(), capacity() - begin);
    std::copy_n(values.data(), first, values_.data() + begin);
    std::copy_n(values.data() + first, values.size() - first, values_.data());
    counts_->written.store(written + values.size(), std::memory_order_release);
  }

  /// Returns the memory for the next `count` values, at most free_count(). Commit appends them once
  /// they have been written there. Called by a producer that always appends the same number of
  /// values; the capacity is a multiple of that number.
  std::span<T> Next(size_t count) noexcept {
    const size_t begin = counts_->written.load(std::memory_order_relaxed) % capacity();
    assert(begin + count <= capacity());
    return values_.subspan(begin, count);
  }

  void Commit(size_t count) noexcept {
    counts_->written.store(counts_->written.load(std::memory_order_relaxed) + count,
                           std::memory_order_release);
  }

  /// Moves up to values.size() values to the front of `values` and returns their number. Called by
  /// the consumer.
  size_t Pop(std::span<T> values) noexcept {
    const size_t read = counts_->read.load(std::memory_order_relaxed);
    const size_t count =
        std::min(values.size(), counts_->written.load(std::memory_order_acquire) - read);
    const size_t begin = read % capacity();
    const size_t first = std::min(count, capacity() - begin);
    std::copy_n(values_.data() + begin, first, values.data());
    std::copy_n(values_.data(), count - first, values.data() + first);
    counts_->read.store(read + count, std::memory_order_release);
    return count;
  }

 private:
  std::span<T> values_;
  RingCounts* counts_;
};

template <typename T>
struct RingStorage {
  explicit RingStorage(size_t capacity) : values(capacity) {}

  std::vector<T> values;
  RingCounts counts;
};

/// A ring buffer that owns its memory.
template <typename T>
class RingBuffer : private RingStorage<T>, public RingView<T> {
 public:
  explicit RingBuffer(size_t capacity)
      : RingStorage<T>(capacity), RingView<T>(RingStorage<T>::values, RingStorage<T>::counts) {}
  RingBuffer(const RingBuffer&) = delete;
  RingBuffer& operator=(const RingBuffer&) = delete;
};

}  // namespace carillon
