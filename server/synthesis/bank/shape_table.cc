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
/// Rows begin with a cache line.
constexpr size_t kLineValues = 32;

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
  std::vector<float> inverses(mode_count, 0.0F);
  for (size_t mode = 0; mode < mode_count; ++mode) {
    scales_[mode] /= kMost;
    // Below, the inverse would be infinite; such a shape is no sound.
    if (scales_[mode] >= std::numeric_limits<float>::min()) inverses[mode] = 1 / scales_[mode];
  }
  // One line more: a projection that begins within a row may read past the last.
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
