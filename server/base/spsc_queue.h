// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>

namespace carillon {

/// A bounded queue from one producer thread to one consumer thread. It does not lock, and allocates
/// in its constructor only. `T` is a plain struct.
template <typename T>
class SpscQueue {
 public:
  explicit SpscQueue(size_t capacity) : queue_(capacity) {}

  /// Writes to all memory of a queue that nobody uses yet. The system would otherwise give the
  /// queue its pages one by one while its places are used for the first time.
  void TouchMemory() {
    while (queue_.push(T())) {
    }
    queue_.reset();
  }

  /// Appends a value. Returns false, without taking `value`, if the queue is full. Only the
  /// producer may call it.
  bool TryPush(const T& value) noexcept { return queue_.push(value); }

  /// Returns the number of values for which there is room. Only the producer may call it.
  size_t room() const noexcept { return queue_.write_available(); }

  /// Takes the next value. Returns false, and leaves `value` unchanged, if the queue is empty. Only
  /// the consumer may call it.
  bool TryPop(T& value) noexcept { return queue_.pop(value); }

  /// Moves up to `most` values to `values`, and returns their number. Only the consumer may call
  /// it.
  size_t PopSome(T* values, size_t most) noexcept { return queue_.pop(values, most); }

  /// Called by the consumer.
  bool empty() const noexcept { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace carillon
