// SPDX-License-Identifier: Apache-2.0
// The lanes of a bank in a block with impulses, compiled for each SIMD target; see
// lane_vectors-inl.h.
#if defined(CARILLON_SERVER_SYNTHESIS_STRUCK_VECTORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_SERVER_SYNTHESIS_STRUCK_VECTORS_INL_H_
#undef CARILLON_SERVER_SYNTHESIS_STRUCK_VECTORS_INL_H_
#else
#define CARILLON_SERVER_SYNTHESIS_STRUCK_VECTORS_INL_H_
#endif

#include <algorithm>
#include <cstddef>

#include "server/synthesis/ringing/oscillators-inl.h"
#include "server/synthesis/ringing/ring_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::HWY_NAMESPACE {

/// z *= the gains of the lanes from `lane` on, if there are any.
template <class Z>
HWY_INLINE void ApplyGains(const ring_kernel::Gains& gains, size_t lane, Z& z) {
  if (gains.re == nullptr) return;
  Z gain;
  gain.Load(gains.re + lane, gains.im + lane);
  z.Multiply(gain);
}

/// Vectors with impulses: the whole state, and its fresh share.
template <size_t kVectors, class Ahead>
class StruckVectors {
 public:
  using Z = States<kVectors>;
  Z all, fresh;

  HWY_INLINE StruckVectors(const Oscillators<kVectors>& oscillators, const Ahead& next)
      : oscillators_(oscillators), ahead_(next) {}

  HWY_INLINE void Load(const LaneArrays& lanes, size_t lane) {
    all.Load(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    fresh.Load(lanes.fresh_re.data() + lane, lanes.fresh_im.data() + lane);
    any_fresh_ = true;
  }
  HWY_INLINE void Store(LaneArrays& lanes, size_t lane) const {
    all.Store(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    fresh.Store(lanes.fresh_re.data() + lane, lanes.fresh_im.data() + lane);
  }

  /// Renders from part.begin to part.end.
  HWY_INLINE void Ring(const ring_kernel::StruckPart& part, size_t lane) {
    fresh_at_ = part.begin;
    if (oscillators_.tile_kind == 0) {
      RingFrames(part, lane);
    } else {
      RingNodes(part, lane);
    }
  }

 private:
  /// An impulse within a tile is rendered separately to the tile's end, and then added to the
  /// state.
  HWY_INLINE void RingFrames(const ring_kernel::StruckPart& part, size_t lane) {
    size_t frame = part.begin;
    size_t strike = 0;
    for (; frame + kTileFrames[0] <= part.end; frame += kTileFrames[0]) {
      ahead_.Step(0);
      oscillators_.AddTile(all, part.sums[0] + frame * kMostLanes);
      for (; strike < part.batch.count && part.batch.offsets[strike] < frame + kTileFrames[0];
           ++strike) {
        Strike(part, strike, lane, frame + kTileFrames[0]);
      }
    }
    AdvanceFresh(frame);
    if (const size_t rest = part.end - frame; rest > 0) {
      oscillators_.AddPart(all, rest, part.sums[0] + frame * kMostLanes);
      fresh.Multiply(oscillators_.Power(rest - 1));
      fresh_at_ = part.end;
    }
    for (; strike < part.batch.count; ++strike) Strike(part, strike, lane, part.end);
  }

  /// Renders like RingFrames, but to the nodes of longer tiles.
  HWY_INLINE void RingNodes(const ring_kernel::StruckPart& part, size_t lane) {
    const size_t kind = oscillators_.tile_kind, frame_count = kTileFrames[kind];
    float* nodes = part.sums[kind];
    size_t strike = 0;
    for (size_t frame = part.begin; frame < part.end; frame += frame_count) {
      ahead_.Step(kind);
      const size_t tile_end = std::min(frame + frame_count, part.end);
      Z power;  // advances to the part's end, if that lies within the tile
      const Z* shortened = nullptr;
      if (tile_end < frame + frame_count) {
        power = oscillators_.FramePower(tile_end - frame);
        shortened = &power;
      }
      AddNodes(shortened, all, nodes);
      nodes += kNodeFloats;
      for (; strike < part.batch.count && part.batch.offsets[strike] < frame + frame_count;
           ++strike) {
        Z struck = Struck(part, strike, lane);
        AddNodes(shortened, struck, part.batch.nodes(strike, kind));
        Join(struck, tile_end);
      }
    }
    AdvanceFresh(part.end);
    for (; strike < part.batch.count; ++strike) Join(Struck(part, strike, lane), part.end);
  }

  /// Renders a longer tile. If the part ends within the tile, `shortened` is not null, and the
  /// state advances by *shortened instead of by the whole tile.
  HWY_INLINE void AddNodes(const Z* shortened, Z& z, float* nodes) const {
    const Z begin = z;
    oscillators_.AddClosedTile(z, nodes);
    if (shortened == nullptr) return;
    z = begin;
    z.Multiply(*shortened);
  }

  HWY_INLINE void AdvanceFresh(size_t frame) {
    const size_t tile_frames = kTileFrames[oscillators_.tile_kind];
    if (any_fresh_) {
      oscillators_.Advance((frame - fresh_at_) / tile_frames, fresh);
      const size_t rest = (frame - fresh_at_) % tile_frames;
      if (rest > 0) fresh.Multiply(oscillators_.FramePower(rest));
    }
    fresh_at_ = frame;
  }

  HWY_INLINE Z Struck(const ring_kernel::StruckPart& part, size_t strike, size_t lane) const {
    Z struck;
    struck.Load(part.batch.re(strike, part.lane_count) + lane,
                part.batch.im(strike, part.lane_count) + lane);
    ApplyGains(part.gains, lane, struck);
    return struck;
  }

  /// Renders an impulse up to `tile_end`, the end of its tile, and adds it to the states there.
  HWY_INLINE void Strike(const ring_kernel::StruckPart& part, size_t strike, size_t lane,
                         size_t tile_end) {
    const size_t offset = part.batch.offsets[strike];
    Z struck = Struck(part, strike, lane);
    oscillators_.AddPart(struck, tile_end - offset, part.sums[0] + offset * kMostLanes);
    Join(struck, tile_end);
  }

  /// Adds an impulse's state to the states at `frame`.
  HWY_INLINE void Join(const Z& struck, size_t frame) {
    all.Add(struck);
    if (fresh_at_ != frame) AdvanceFresh(frame);
    fresh.Add(struck);
    any_fresh_ = true;
  }

  const Oscillators<kVectors>& oscillators_;
  Ahead ahead_;
  size_t fresh_at_ = 0;  // the frame that the fresh state belongs to
  bool any_fresh_ = false;
};

}  // namespace carillon::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
