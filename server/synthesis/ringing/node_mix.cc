// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/node_mix.h"

#include <algorithm>
#include <utility>

#include "server/synthesis/ringing/sum_kernel.h"

namespace carillon {

float* NodeMix::Use(size_t kind, size_t frame_count) noexcept {
  float* nodes = nodes_.data() + kFirst[kind];
  if (!std::exchange(used_[kind], true)) {
    const size_t tile_count = (frame_count + kTileFrames[kind] - 1) / kTileFrames[kind];
    std::fill_n(nodes, tile_count * kNodeFloats, 0.0F);
  }
  return nodes;
}

void NodeMix::AddTo(size_t begin, size_t end, float* frames) const noexcept {
  for (size_t kind = 1; kind < kTileKinds; ++kind) {
    if (!used_[kind]) continue;
    sum_kernel::AddTiles({.kind = kind, .begin = begin, .end = end}, nodes_.data() + kFirst[kind],
                         frames);
  }
}

}  // namespace carillon
