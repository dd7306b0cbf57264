// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/lane_mix.h"

#include <algorithm>

#include "server/synthesis/ringing/sum_kernel.h"

namespace carillon {

void LaneMix::Clear(size_t frame_count) noexcept {
  std::fill_n(lanes_.data(), frame_count * kMostLanes, 0.0F);
  std::fill_n(frames_.data(), frame_count, 0.0F);
  nodes_.Clear();
}

void LaneMix::Reduce(std::span<float> block) noexcept {
  sum_kernel::SumLanes(lanes_.data(), block);
  nodes_.AddTo(0, block.size(), frames_.data());
  for (size_t n = 0; n < block.size(); ++n) block[n] += frames_[n];
}

}  // namespace carillon
