// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/spectrum/long_block.h"

#include <algorithm>
#include <bit>
#include <numbers>

namespace carillon {
namespace {

constexpr std::array<size_t, kLongBlockKinds> kTargetFrames = {256, 512, 1024, 2048};
/// The largest decay in bins, -sigma M/(2 pi). Beyond this decay the error of the truncated kernel
/// exceeds -120 dB. It corresponds to a T60 of 160 ms at 2048 frames and 48 kHz, and of 20 ms at
/// 256 frames.
constexpr double kMostDecayBins = 0.6;

}  // namespace

std::array<LongBlock, kLongBlockKinds> MakeLongBlocks(size_t block_frame_count) {
  std::array<LongBlock, kLongBlockKinds> blocks;
  for (size_t kind = 0; kind < kLongBlockKinds; ++kind) {
    const size_t count = std::max<size_t>(kTargetFrames[kind] / block_frame_count, 1);
    const size_t frames = std::bit_floor(count) * block_frame_count;
    blocks[kind] = {std::bit_floor(count), frames, std::bit_ceil(2 * frames)};
  }
  return blocks;
}

std::optional<size_t> ChooseLongBlock(std::complex<double> log_q, size_t block_frame_count) {
  const auto blocks = MakeLongBlocks(block_frame_count);
  for (size_t kind = kLongBlockKinds; kind-- > 0;) {
    const double bins =
        -log_q.real() * static_cast<double>(blocks[kind].grid_size) / (2 * std::numbers::pi);
    if (bins >= 0 && bins <= kMostDecayBins) return kind;
  }
  return std::nullopt;
}

}  // namespace carillon
