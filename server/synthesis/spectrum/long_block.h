// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <optional>

namespace carillon {

/// Modes that ring freely are rendered by spectrum, in blocks longer than the mixer's: the longer,
/// the cheaper, and the less a mode may decay within one. Of each kind of length there is one
/// spectrum a section.
inline constexpr size_t kLongBlockKinds = 4;

/// One kind of long block.
struct LongBlock {
  size_t block_count = 0;  ///< so many of the mixer's blocks
  size_t frame_count = 0;
  size_t grid_size = 0;  ///< points of the transform, a power of two, at least twice frame_count
};

/// The long blocks of a mixer: about 256, 512, 1024 and 2048 frames, whole blocks of the mixer.
std::array<LongBlock, kLongBlockKinds> MakeLongBlocks(size_t block_frame_count);

/// The longest kind in which a mode, which `log_q` = (sigma + i omega)/rate advances by a frame,
/// keeps its accuracy; none for a mode that decays too fast for all of them.
std::optional<size_t> ChooseLongBlock(std::complex<double> log_q, size_t block_frame_count);

}  // namespace carillon
