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

  /// Called by the producer. Returns false, without taking `value`, if the queue is full.
  bool TryPush(const T& value) noexcept { return queue_.push(value); }

  /// Called by the producer. Returns the number of values for which there is room.
  size_t room() const noexcept { return queue_.write_available(); }

  /// Called by the consumer. Returns false, and leaves `value` unchanged, if the queue is empty.
  bool TryPop(T& value) noexcept { return queue_.pop(value); }

  /// Called by the consumer. Moves up to `most` values to `values`; returns their number.
  size_t PopSome(T* values, size_t most) noexcept { return queue_.pop(values, most); }

  /// Called by the consumer.
  bool empty() const noexcept { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace carillon
