// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/frames.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace carillon {

void AddTo(std::span<const float> more, std::span<float> sum) noexcept {
  for (size_t n = 0; n < sum.size(); ++n) sum[n] += more[n];
}

void Spread(std::span<const float> mono, size_t channel_count, std::span<float> frames) noexcept {
  if (channel_count == 1) {
    std::ranges::copy(mono.first(frames.size()), frames.begin());
    return;
  }
  if (channel_count > 2) {
    std::ranges::fill(frames, 0.0F);
    for (size_t n = 0; n < frames.size() / channel_count; ++n) frames[channel_count * n] = mono[n];
    return;
  }
  for (size_t n = 0; n < frames.size() / 2; ++n) frames[2 * n] = frames[2 * n + 1] = mono[n];
}

void MultiplyFrames(std::span<const float> gains, size_t channel_count,
                    std::span<float> frames) noexcept {
  if (channel_count == 1) {
    for (size_t n = 0; n < frames.size(); ++n) frames[n] *= gains[n];
    return;
  }
  if (channel_count > 2) {
    for (size_t i = 0; i < frames.size(); ++i) frames[i] *= gains[i / channel_count];
    return;
  }
  for (size_t n = 0; n < frames.size() / 2; ++n) {
    frames[2 * n] *= gains[n];
    frames[2 * n + 1] *= gains[n];
  }
}

float LargestMagnitude(std::span<const float> samples) noexcept {
  // The bits of floats without a sign are ordered as the floats are, and compilers may find the
  // largest of integers in any order.
  constexpr uint32_t kMagnitude = 0x7FFFFFFF;
  uint32_t largest = 0;
  for (const float sample : samples) {
    largest = std::max(largest, std::bit_cast<uint32_t>(sample) & kMagnitude);
  }
  return std::bit_cast<float>(largest);
}

}  // namespace carillon
