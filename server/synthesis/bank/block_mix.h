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

/// Workspace of one rendering thread, which may serve many mixes in turn.
struct RenderWorkspace {
  explicit RenderWorkspace(size_t block_frame_count);

  StrikeBatch batch;
  std::array<Spectrum, kLongBlockKinds> spectra;
  LaneMix lanes, lanes_apart;
};

/// What some banks sound like together, block by block: the sum of what rings in the time domain
/// and of the long blocks under way.
class BlockMix {
 public:
  static constexpr size_t kStaggers = 16;

  /// Mixes of different stagger, 0 to kStaggers - 1, begin long blocks in different blocks: a long
  /// block of m blocks where m divides the block's number plus stagger * m / kStaggers.
  explicit BlockMix(size_t block_frame_count, size_t stagger = 0);

  /// Begins the block of this number; Begin and Finish alternate.
  void Begin(uint64_t block_number, RenderWorkspace& workspace) noexcept;

  /// Writes the block.
  void Finish(std::span<float> block) noexcept;

  /// Whether a long block of this kind begins with this block.
  bool begins(size_t kind) const noexcept { return begins_[kind]; }

  /// Whether one of any kind does.
  bool any_begins() const noexcept { return any_begins_; }

  /// Where modes add themselves to the long block of this kind that begins.
  float* Slots(size_t kind) noexcept {
    used_[kind] = true;
    return workspace_->spectra[kind].slots();
  }

  /// No long block is under way: without banks there is silence.
  bool idle() const noexcept;

  /// What rings in the time domain goes here.
  LaneMix& lanes() noexcept { return apart_ ? workspace_->lanes_apart : workspace_->lanes; }

  /// From now on that is not part of the block, until Reunite; in the middle of it nothing changes.
  void SetApart(size_t block_frame_count) noexcept;
  /// Adds what rang apart to `frames`.
  void TakeApart(std::span<float> frames) noexcept;
  void Reunite() noexcept { apart_ = false; }

  StrikeBatch& batch() noexcept { return workspace_->batch; }

 private:
  /// Frames of a long block under way.
  struct Rendered {
    std::vector<float> frames;
    size_t next = 0;
    bool sounding = false;
  };

  std::array<LongBlock, kLongBlockKinds> long_blocks_;
  size_t stagger_;
  RenderWorkspace* workspace_ = nullptr;
  std::array<bool, kLongBlockKinds> begins_{}, used_{};
  bool any_begins_ = false;
  std::array<Rendered, kLongBlockKinds> rendered_;
  bool apart_ = false;
};

}  // namespace carillon
