// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/synthesis/ringing/lane_mix.h"
#include "server/synthesis/ringing/strike_batch.h"
#include "server/synthesis/spectrum/long_block.h"
#include "server/synthesis/spectrum/spectrum.h"

namespace carillon {

/// Scratch memory of one rendering thread; several mixes may use it one after the other.
struct RenderWorkspace {
  explicit RenderWorkspace(size_t block_frame_count);

  StrikeBatch batch;
  std::array<Spectrum, kLongBlockKinds> spectra;
  LaneMix lanes, lanes_apart, lanes_fading, lanes_unheard;
};

/// Sums the sound of banks block by block: the banks that ring in the time domain, and the long
/// blocks of the banks that ring by spectrum.
class BlockMix {
 public:
  static constexpr size_t kStaggers = 16;

  /// Mixes of different `stagger`, 0 to kStaggers - 1, begin long blocks in different blocks,
  /// because a long block of m blocks begins where m divides block number + stagger * m /
  /// kStaggers.
  explicit BlockMix(size_t block_frame_count, size_t stagger = 0);

  /// Begins the block of this number. The caller calls Begin and Finish in turn.
  void Begin(uint64_t block_number, RenderWorkspace& workspace) noexcept;

  /// Writes the sum to `block`.
  void Finish(std::span<float> block) noexcept;

  /// Ends the long blocks that are being played. The caller must call it between Finish and Begin.
  void Silence() noexcept;

  /// The number that the last Begin was given.
  uint64_t block_number() const noexcept { return block_number_; }

  /// Whether a long block of this kind begins in this block.
  bool begins(size_t kind) const noexcept { return begins_[kind]; }

  /// Whether a long block of any kind begins in this block.
  bool any_begins() const noexcept { return any_begins_; }

  /// Returns the slots (Spectrum::slots) of the long block of this kind that begins in this block,
  /// so that modes can be added to them.
  float* Slots(size_t kind) noexcept {
    used_[kind] = true;
    return workspace_->spectra[kind].slots();
  }

  /// Whether no long block is being played, so that the mix is silent without banks.
  bool idle() const noexcept;

  /// Banks that ring in the time domain add their sound to these lanes.
  LaneMix& lanes() noexcept { return apart_ ? workspace_->lanes_apart : workspace_->lanes; }

  /// Redirects lanes() to a private buffer until Reunite(). Calling it again before then has no
  /// effect.
  void SetApart(size_t block_frame_count) noexcept;
  /// Returns a second private buffer, between SetApart and Reunite. Its sound is faded out over the
  /// block while the sound of lanes() is faded in. If fading() is not called, lanes() sounds at its
  /// full level.
  LaneMix& fading(size_t block_frame_count) noexcept;

  /// Returns a buffer for sound that is rendered only to advance the states, and is not heard.
  LaneMix& unheard() noexcept { return workspace_->lanes_unheard; }

  /// Adds the sound in the private buffers to `frames`.
  void TakeApart(std::span<float> frames) noexcept;
  void Reunite() noexcept { apart_ = false; }

  StrikeBatch& batch() noexcept { return workspace_->batch; }

 private:
  /// The long block of one kind that is being played.
  struct Rendered {
    std::vector<float> frames;
    size_t next = 0;
    bool sounding = false;
  };

  std::array<LongBlock, kLongBlockKinds> long_blocks_;
  size_t stagger_;
  RenderWorkspace* workspace_ = nullptr;
  uint64_t block_number_ = 0;
  std::array<bool, kLongBlockKinds> begins_{}, used_{};
  bool any_begins_ = false;
  std::array<Rendered, kLongBlockKinds> rendered_;
  bool apart_ = false, fades_ = false;
};

}  // namespace carillon
