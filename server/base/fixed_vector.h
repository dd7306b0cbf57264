// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <memory>
#include <utility>

namespace carillon {

/// A vector of fixed capacity that allocates in its constructor only, for use on rendering threads.
/// `T` is a plain struct.
template <typename T>
class FixedVector {
 public:
  explicit FixedVector(size_t capacity)
      : capacity_(capacity), values_(std::make_unique_for_overwrite<T[]>(capacity)) {}

  /// Appends a value. A value beyond the capacity is a bug of the caller and is discarded.
  void push_back(const T& value) noexcept {
    assert(size_ < capacity_);
    if (size_ < capacity_) values_[size_++] = value;
  }
  void clear() noexcept { size_ = 0; }

  /// Erases the values for which `predicate` is true. Calls `predicate` once for each value, in
  /// order.
  template <typename Predicate>
  void EraseIf(Predicate predicate) noexcept {
    size_ = static_cast<size_t>(std::remove_if(begin(), end(), predicate) - begin());
  }

  T* begin() noexcept { return values_.get(); }
  T* end() noexcept { return values_.get() + size_; }
  const T* begin() const noexcept { return values_.get(); }
  const T* end() const noexcept { return values_.get() + size_; }
  T* data() noexcept { return values_.get(); }
  const T* data() const noexcept { return values_.get(); }
  T& operator[](size_t i) noexcept { return values_[i]; }
  const T& operator[](size_t i) const noexcept { return values_[i]; }
  size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }

 private:
  size_t capacity_;
  size_t size_ = 0;
  std::unique_ptr<T[]> values_;
};

}  // namespace carillon
