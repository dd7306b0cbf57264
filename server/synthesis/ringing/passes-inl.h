// SPDX-License-Identifier: Apache-2.0
// Passes over all lanes of a bank, some vectors at a time, compiled for each SIMD target; see
// lane_vectors-inl.h.
#if defined(CARILLON_SERVER_SYNTHESIS_PASSES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_SERVER_SYNTHESIS_PASSES_INL_H_
#undef CARILLON_SERVER_SYNTHESIS_PASSES_INL_H_
#else
#define CARILLON_SERVER_SYNTHESIS_PASSES_INL_H_
#endif

#include <cstddef>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/oscillators-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::HWY_NAMESPACE {

// Vectors rendered together. Four vectors share the loads and stores of the sums; their powers come
// from the cache.
constexpr size_t kVectorsPerPass = 4;

/// Prefetches the powers of the next pass's vectors, a share with each tile of this pass, because
/// simultaneous requests would wait for each other.
template <size_t kVectors>
class Prefetching {
 public:
  /// Prefetching past the last lane is harmless.
  HWY_INLINE Prefetching(const LaneArrays& lanes, size_t lane)
      : next_(lanes.powers.data() +
              LaneArrays::PowerIndex(lane + kVectorsPerPass * hn::MaxLanes(Floats()), 0)) {}

  /// Prefetches the share of one tile.
  HWY_INLINE void Step(size_t tile_kind) {
    // Processors fetch cache lines in pairs.
    constexpr size_t kLines = 128 / sizeof(float);
    end_ += kPowers * kTileFrames[tile_kind] / kFrames;
    for (; next_ < end_; next_ += kLines) __builtin_prefetch(next_);
  }

 private:
  static constexpr size_t kFrames = 128;
  static constexpr size_t kPowers = kVectors * hn::MaxLanes(Floats()) * 2 * kTileNodes;

  const float* next_;
  const float* end_ = next_;
};

/// How lanes are rendered.
struct Manner {
  size_t tile_kind = 0;
  bool by_frames = false;  ///< in tiles of the first kind, whatever tile_kind is
  size_t frame_count = 0;  ///< frames to be rendered, if by_frames
};

/// Calls ring(oscillators, prefetching, lane) for kVectors vectors from `lane` on.
template <size_t kVectors, class RingSome>
HWY_INLINE void ForSome(const LaneArrays& lanes, size_t lane, Manner manner, const RingSome& ring) {
  Oscillators<kVectors> oscillators(lanes, lane, manner.tile_kind);
  FramePowers<kVectors> powers;
  if (manner.by_frames && manner.tile_kind > 0) {
    powers.Set(lanes, lane, manner.frame_count);
    oscillators.Use(powers);
  }
  ring(oscillators, Prefetching<kVectors>(lanes, lane), lane);
}

/// Calls ring for the `count` vectors from `lane` on, at most kMost.
template <size_t kMost, class RingSome>
HWY_INLINE void ForRest(const LaneArrays& lanes, size_t lane, size_t count, Manner manner,
                        const RingSome& ring) {
  if (count == kMost) {
    ForSome<kMost>(lanes, lane, manner, ring);
  } else if constexpr (kMost > 1) {
    ForRest<kMost - 1>(lanes, lane, count, manner, ring);
  }
}

/// Calls ring for all lanes of `range`, kVectorsPerPass vectors at a time.
template <class RingSome>
HWY_INLINE void ForVectors(const LaneArrays& lanes, LaneRange range, Manner manner,
                           const RingSome& ring) {
  const size_t pass = kVectorsPerPass * hn::Lanes(Floats());
  const size_t end = range.first + range.count;
  size_t lane = range.first;
  for (; lane + pass <= end; lane += pass) ForSome<kVectorsPerPass>(lanes, lane, manner, ring);
  ForRest<kVectorsPerPass - 1>(lanes, lane, (end - lane) / hn::Lanes(Floats()), manner, ring);
}

/// Calls ring for all lanes of the bank, in ascending order.
template <class RingSome>
HWY_INLINE void ForVectors(const LaneArrays& lanes, Manner manner, const RingSome& ring) {
  for (const size_t tile_kind : kTileOrder) {
    manner.tile_kind = tile_kind;
    ForVectors(lanes, lanes.by_tile[tile_kind], manner, ring);
  }
}

}  // namespace carillon::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
