// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/shape_table.h"

#include <sys/mman.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>

namespace carillon {
namespace {

constexpr float kMost = std::numeric_limits<int16_t>::max();
/// Rows begin with a cache line.
constexpr size_t kLineValues = 32;
constexpr size_t kLineBytes = 64;
constexpr size_t kHugePageBytes = size_t{1} << 21;

/// Rows are read at random: from a large table in pages of 4 KiB every one costs a walk through the
/// page table.
std::shared_ptr<int16_t> Allocate(size_t count) {
  const size_t alignment = count * sizeof(int16_t) < kHugePageBytes ? kLineBytes : kHugePageBytes;
  const size_t bytes = (count * sizeof(int16_t) + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, bytes);
  if (memory == nullptr) throw std::bad_alloc();
#if defined(MADV_HUGEPAGE)
  if (alignment == kHugePageBytes) madvise(memory, bytes, MADV_HUGEPAGE);
#endif
  return {static_cast<int16_t*>(memory), std::free};
}

// To the nearest integer, below 2^22: what a float of that size keeps behind 1.5 * 2^23. A table of
// a hundred megabytes is made while an object waits for it, and std::lrint is not taken by the
// vector.
int16_t Rounded(float value) {
  constexpr float kBare = 12582912.0F;
  return static_cast<int16_t>(std::bit_cast<int32_t>(value + kBare) -
                              std::bit_cast<int32_t>(kBare));
}

}  // namespace

ShapeTable::ShapeTable(std::span<const float> shapes, size_t vertex_count, size_t mode_count)
    : vertex_count_(vertex_count),
      mode_count_(mode_count),
      stride_((mode_count + kLineValues - 1) / kLineValues * kLineValues),
      scales_(mode_count, 0.0F) {
  assert(shapes.size() == 3 * vertex_count * mode_count);
  for (size_t row = 0; row < 3 * vertex_count; ++row) {
    const float* const values_of_row = &shapes[row * mode_count];
    for (size_t mode = 0; mode < mode_count; ++mode) {
      scales_[mode] = std::max(scales_[mode], std::abs(values_of_row[mode]));
    }
  }
  for (float& scale : scales_) scale /= kMost;
  // One line more: a projection that begins within a row may read past the last.
  const size_t count = 3 * vertex_count * stride_ + kLineValues;
  const std::shared_ptr<int16_t> values = Allocate(count);
  std::fill_n(values.get(), count, int16_t{0});
  for (size_t row = 0; row < 3 * vertex_count; ++row) {
    for (size_t mode = 0; mode < mode_count; ++mode) {
      const float scale = scales_[mode];
      const float value = scale > 0 ? shapes[row * mode_count + mode] / scale : 0;
      values.get()[row * stride_ + mode] = Rounded(value);
    }
  }
  values_ = values;
}

}  // namespace carillon
