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

  /// Producer only. False: the queue is full and `value` was not taken.
  bool TryPush(const T& value) noexcept { return queue_.push(value); }

  /// Consumer only. False: the queue is empty and `value` is untouched.
  bool TryPop(T& value) noexcept { return queue_.pop(value); }

  /// Consumer only. Moves up to `most` values to `values`; returns how many.
  size_t PopSome(T* values, size_t most) noexcept { return queue_.pop(values, most); }

  /// Consumer only.
  bool empty() const noexcept { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace carillon
