// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/lane_mix.h"

#include <algorithm>

namespace carillon {

void LaneMix::Clear(size_t frame_count) noexcept {
  std::fill_n(lanes_.data(), frame_count * kMostLanes, 0.0F);
}

void LaneMix::Reduce(std::span<float> block) const noexcept {
  const float* lanes = lanes_.data();
  for (float& sample : block) {
    std::array<float, 4> sum{};
    for (size_t lane = 0; lane < kMostLanes; ++lane) sum[lane % 4] += lanes[lane];
    sample = (sum[0] + sum[2]) + (sum[1] + sum[3]);
    lanes += kMostLanes;
  }
}

}  // namespace carillon
