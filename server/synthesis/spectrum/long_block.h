// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <optional>

namespace carillon {

/// Freely ringing modes are rendered by spectrum, in long blocks that cover several blocks of the
/// mixer. Longer blocks are cheaper, but a mode may decay less within them, so there are four
/// kinds. A section has one spectrum for each kind; a kind's long blocks follow each other without
/// a gap. The sections' long blocks are staggered, so that only a share of all transforms falls
/// into any block:
///
///   mixer's block          0   1   2   3   4   5   6   7   8
///   section 0, 512 frames  |===============|===============|===
///   section 4              ============|===============|=======
///   section 8              ========|===============|===========
inline constexpr size_t kLongBlockKinds = 4;

/// One kind of long block.
struct LongBlock {
  size_t block_count = 0;  ///< blocks of the mixer in a long block
  size_t frame_count = 0;
  size_t grid_size = 0;  ///< points of the transform, a power of two, at least twice frame_count
};

/// The kinds of long blocks of a mixer: about 256, 512, 1024 and 2048 frames, whole blocks of the
/// mixer.
std::array<LongBlock, kLongBlockKinds> MakeLongBlocks(size_t block_frame_count);

/// Returns the longest kind that renders a mode accurately, or no kind if the mode decays too fast
/// for all. `log_q` = (sigma + i omega)/rate.
std::optional<size_t> ChooseLongBlock(std::complex<double> log_q, size_t block_frame_count);

}  // namespace carillon
