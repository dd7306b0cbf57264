// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/shape_table.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace carillon {
namespace {

constexpr float kMost = std::numeric_limits<int16_t>::max();
/// Values in a cache line; rows are aligned to cache lines.
constexpr size_t kLineValues = 32;

// Rounds a value below 2^22 to the nearest integer: adding 1.5 * 2^23 leaves the integer in the low
// bits of the float. A table may have a hundred megabytes, and compilers do not vectorize
// std::lrint.
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
  std::vector<float> inverses(mode_count, 0.0F);
  for (size_t mode = 0; mode < mode_count; ++mode) {
    scales_[mode] /= kMost;
    // The inverse of a smaller scale would be infinite; such a shape is inaudible.
    if (scales_[mode] >= std::numeric_limits<float>::min()) inverses[mode] = 1 / scales_[mode];
  }
  // A projection that begins within the last row may read one line past it.
  auto memory = std::make_shared<std::vector<int16_t, LargeAllocator<int16_t>>>();
  memory->resize(3 * vertex_count * stride_ + kLineValues);
  int16_t* values = memory->data();
  for (size_t row = 0; row < 3 * vertex_count; ++row, values += stride_) {
    const float* const values_of_row = &shapes[row * mode_count];
    for (size_t mode = 0; mode < mode_count; ++mode) {
      values[mode] = Rounded(values_of_row[mode] * inverses[mode]);
    }
    std::fill(values + mode_count, values + stride_, int16_t{0});
  }
  std::fill_n(values, kLineValues, int16_t{0});
  values_ = memory->data();
  memory_ = std::move(memory);
}

}  // namespace carillon
