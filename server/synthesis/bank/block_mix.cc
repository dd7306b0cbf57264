// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/block_mix.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace carillon {
namespace {

template <size_t... kKinds>
std::array<Spectrum, kLongBlockKinds> MakeSpectra(size_t block_frame_count,
                                                  std::index_sequence<kKinds...>) {
  const auto blocks = MakeLongBlocks(block_frame_count);
  return {Spectrum(blocks[kKinds])...};
}

}  // namespace

RenderWorkspace::RenderWorkspace(size_t block_frame_count)
    : spectra(MakeSpectra(block_frame_count, std::make_index_sequence<kLongBlockKinds>())) {}

BlockMix::BlockMix(size_t block_frame_count, size_t stagger)
    : long_blocks_(MakeLongBlocks(block_frame_count)), stagger_(stagger) {
  for (size_t kind = 0; kind < kLongBlockKinds; ++kind) {
    rendered_[kind].frames.resize(long_blocks_[kind].frame_count);
  }
}

void BlockMix::Begin(uint64_t block_number, RenderWorkspace& workspace) noexcept {
  workspace_ = &workspace;
  block_number_ = block_number;
  any_begins_ = false;
  for (size_t kind = 0; kind < kLongBlockKinds; ++kind) {
    const size_t count = long_blocks_[kind].block_count;
    begins_[kind] = (block_number + stagger_ * count / kStaggers) % count == 0;
    used_[kind] = false;
    any_begins_ |= begins_[kind];
  }
  workspace_->lanes.Clear(long_blocks_[0].frame_count / long_blocks_[0].block_count);
}

bool BlockMix::idle() const noexcept {
  return std::ranges::none_of(rendered_, &Rendered::sounding);
}

void BlockMix::Silence() noexcept {
  for (Rendered& rendered : rendered_) rendered.sounding = false;
}

void BlockMix::SetApart(size_t block_frame_count) noexcept {
  if (!apart_) workspace_->lanes_apart.Clear(block_frame_count);
  if (!apart_) fades_ = false;
  apart_ = true;
}

LaneMix& BlockMix::fading(size_t block_frame_count) noexcept {
  assert(apart_);
  if (!std::exchange(fades_, true)) workspace_->lanes_fading.Clear(block_frame_count);
  return workspace_->lanes_fading;
}

void BlockMix::TakeApart(std::span<float> frames) noexcept {
  std::array<float, kMostBlockFrames> apart;
  const std::span<float> block = std::span(apart).first(frames.size());
  workspace_->lanes_apart.Reduce(block);
  if (fades_) {
    std::array<float, kMostBlockFrames> fading;
    workspace_->lanes_fading.Reduce(std::span(fading).first(frames.size()));
    const float step = 1 / static_cast<float>(frames.size());
    for (size_t n = 0; n < frames.size(); ++n) {
      block[n] = fading[n] + static_cast<float>(n) * step * (block[n] - fading[n]);
    }
  }
  for (size_t n = 0; n < frames.size(); ++n) frames[n] += block[n];
}

void BlockMix::Finish(std::span<float> block) noexcept {
  workspace_->lanes.Reduce(block);
  for (size_t kind = 0; kind < kLongBlockKinds; ++kind) {
    Rendered& rendered = rendered_[kind];
    if (begins_[kind]) {
      rendered.next = 0;
      rendered.sounding = used_[kind];
      if (used_[kind]) workspace_->spectra[kind].Transform(rendered.frames);
    }
    if (!rendered.sounding) continue;
    assert(rendered.next + block.size() <= rendered.frames.size());
    const float* frames = rendered.frames.data() + rendered.next;
    for (size_t n = 0; n < block.size(); ++n) block[n] += frames[n];
    rendered.next += block.size();
  }
}

}  // namespace carillon
