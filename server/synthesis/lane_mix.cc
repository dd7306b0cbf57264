// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/lane_mix.h"

#include <algorithm>

#include "server/synthesis/ring_kernel.h"

namespace carillon {

void LaneMix::Clear(size_t frame_count) noexcept {
  std::fill_n(lanes_.data(), frame_count * kMostLanes, 0.0F);
}

void LaneMix::Reduce(std::span<float> block) const noexcept {
  ring_kernel::SumLanes(lanes_.data(), block);
}

}  // namespace carillon
