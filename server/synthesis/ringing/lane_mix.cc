// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/lane_mix.h"

#include <algorithm>
#include <utility>

#include "server/synthesis/ringing/sum_kernel.h"

namespace carillon {

void LaneMix::Clear(size_t frame_count) noexcept {
  frame_count_ = frame_count;
  uses_lanes_ = uses_frames_ = false;
  nodes_.Clear();
}

float* LaneMix::lanes() noexcept {
  if (!std::exchange(uses_lanes_, true)) {
    std::fill_n(lanes_.data(), frame_count_ * kMostLanes, 0.0F);
  }
  return lanes_.data();
}

float* LaneMix::frames() noexcept {
  if (!std::exchange(uses_frames_, true)) std::fill_n(frames_.data(), frame_count_, 0.0F);
  return frames_.data();
}

void LaneMix::Reduce(std::span<float> block) noexcept {
  if (uses_lanes_) {
    sum_kernel::SumLanes(lanes_.data(), block);
  } else {
    std::ranges::fill(block, 0.0F);
  }
  if (nodes_.used()) nodes_.AddTo(0, block.size(), frames());
  if (!uses_frames_) return;
  for (size_t n = 0; n < block.size(); ++n) block[n] += frames_[n];
}

}  // namespace carillon
