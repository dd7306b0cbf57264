// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/base/large_allocator.h"

namespace carillon {

/// Mode shapes of one body on its sounding surface, onto which impulses are projected. Values have
/// 16 bits and are scaled by each mode's largest value, because projecting many impulses is limited
/// by memory bandwidth. The rounding error is 101 dB below that largest value, root mean square.
/// Copies share the values.
class ShapeTable {
 public:
  ShapeTable() = default;

  /// Copies `shapes`, vertex_count by 3 by mode_count, row-major: shapes[(vertex * 3 + axis) *
  /// mode_count + mode].
  ShapeTable(std::span<const float> shapes, size_t vertex_count, size_t mode_count);

  size_t vertex_count() const noexcept { return vertex_count_; }
  size_t mode_count() const noexcept { return mode_count_; }

  /// Values of all modes at a vertex along an axis, in units of scale(mode). The row may be read up
  /// to the end of the last value's SIMD vector.
  const int16_t* Row(size_t vertex, size_t axis) const noexcept {
    return values_ + (3 * vertex + axis) * stride_;
  }

  /// Values from one row to the next.
  size_t stride() const noexcept { return stride_; }

  float scale(size_t mode) const noexcept { return scales_[mode]; }

 private:
  size_t vertex_count_ = 0;
  size_t mode_count_ = 0;
  size_t stride_ = 0;
  std::vector<float> scales_;
  std::shared_ptr<const std::vector<int16_t, LargeAllocator<int16_t>>> memory_;
  const int16_t* values_ = nullptr;  // points into memory_
};

}  // namespace carillon
