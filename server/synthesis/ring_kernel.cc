// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ring_kernel.h"

// Vectors of unknown size cannot be kept in arrays, and kMostLanes bounds them.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/ring_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "server/synthesis/lane_vectors-inl.h"
#include "server/synthesis/oscillators-inl.h"
// clang-format on

#include <algorithm>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace carillon::ring_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using carillon::HWY_NAMESPACE::Doubles;
using carillon::HWY_NAMESPACE::Floats;
using carillon::HWY_NAMESPACE::HalfFloats;
using carillon::HWY_NAMESPACE::kMostSquared;
using carillon::HWY_NAMESPACE::Loudness;
using carillon::HWY_NAMESPACE::Oscillators;
using carillon::HWY_NAMESPACE::States;
using carillon::HWY_NAMESPACE::V;

// Vectors rendered together: four share the sums, which are as many loads and stores less; the
// powers come from the cache.
constexpr size_t kVectorsAPass = 4;

/// Asks for what the vectors after some will need, bit by bit while those are rendered: at once,
/// the requests would only wait for each other.
class Prefetching {
 public:
  /// Behind the last lane nothing is there, which does no harm.
  HWY_INLINE Prefetching(const LaneArrays& lanes, size_t lane)
      : powers_(lanes.powers.data() + LaneArrays::PowerIndex(lane, 0)),
        states_{lanes.re.data() + lane, lanes.im.data() + lane},
        blocks_{lanes.block_re.data() + lane, lanes.block_im.data() + lane} {}

  HWY_INLINE void Step() {
    Prefetch(powers_, kPowers);
    powers_ += kPowers;
    if (step_++ % kSteps < kSteps / 2) {
      StepBoth(states_);
    } else {
      StepBoth(blocks_);
    }
  }

 private:
  static constexpr size_t kSteps = 128 / kTileFrames;
  static constexpr size_t kLanes = kVectorsAPass * hn::MaxLanes(Floats());
  static constexpr size_t kPowers = kLanes * 2 * kTileFrames / kSteps;
  static constexpr size_t kDoubles = kLanes / (kSteps / 2);

  template <typename T>
  static HWY_INLINE void Prefetch(const T* first, size_t count) {
    constexpr size_t kLine = 64;
    for (size_t i = 0; i < count; i += kLine / sizeof(T)) __builtin_prefetch(first + i);
  }
  static HWY_INLINE void StepBoth(const double* (&arrays)[2]) {
    for (const double*& array : arrays) {
      Prefetch(array, kDoubles);
      array += kDoubles;
    }
  }

  const float* powers_;
  const double *states_[2], *blocks_[2];
  size_t step_ = 0;
};

/// Where no vectors come after some.
struct NothingAhead {
  HWY_INLINE void Step() const {}
};

/// Calls ring(oscillators, ahead, lane) for the vectors at `lane`, at most kMost.
template <size_t kMost, class RingSome>
HWY_INLINE void ForRest(const LaneArrays& lanes, size_t lane, size_t count, const RingSome& ring) {
  if (count == kMost) {
    ring(Oscillators<kMost>(lanes, lane), NothingAhead(), lane);
  } else if constexpr (kMost > 1) {
    ForRest<kMost - 1>(lanes, lane, count, ring);
  }
}

/// The same for all lanes of `range`, some vectors at a time.
template <class RingSome>
HWY_INLINE void ForVectors(const LaneArrays& lanes, LaneRange range, const RingSome& ring) {
  const size_t pass = kVectorsAPass * hn::Lanes(Floats());
  const size_t end = range.first + range.count;
  size_t lane = range.first;
  for (; lane + pass <= end; lane += pass) {
    ring(Oscillators<kVectorsAPass>(lanes, lane), Prefetching(lanes, lane + pass), lane);
  }
  ForRest<kVectorsAPass - 1>(lanes, lane, (end - lane) / hn::Lanes(Floats()), ring);
}

void Ring(const LaneArrays& lanes, LaneRange range, size_t frame_count, float* mix) {
  ForVectors(lanes, range, [&](const auto& oscillators, auto ahead, size_t lane) {
    typename std::decay_t<decltype(oscillators)>::Z z;
    z.Load(lanes.re.data() + lane, lanes.im.data() + lane);
    size_t frame = 0;
    for (; frame + kTileFrames <= frame_count; frame += kTileFrames) {
      ahead.Step();
      oscillators.AddTile(z, mix + frame * kMostLanes);
    }
    oscillators.AddPart(z, frame_count - frame, mix + frame * kMostLanes);
  });
}

/// Vectors that are struck: what rings, and of it what is newborn.
template <size_t kVectors, class Ahead>
struct StruckVectors {
  using Z = States<kVectors>;
  const Oscillators<kVectors>& oscillators;
  Ahead ahead;
  Z all, newborn;
  size_t newborn_at = 0;  // the frame of its state
  bool any_newborn = false;

  HWY_INLINE void Load(const LaneArrays& lanes, size_t lane) {
    all.Load(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    newborn.Load(lanes.newborn_re.data() + lane, lanes.newborn_im.data() + lane);
    any_newborn = true;
  }
  HWY_INLINE void Store(LaneArrays& lanes, size_t lane) const {
    all.Store(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    newborn.Store(lanes.newborn_re.data() + lane, lanes.newborn_im.data() + lane);
  }

  /// From part.begin to part.end, in tiles from there on. What is struck within a tile is rendered
  /// to the tile's end beside the rest, and is a part of it from there on.
  HWY_INLINE void Ring(const StruckPart& part, size_t lane, float* mix) {
    size_t frame = newborn_at = part.begin;
    size_t strike = 0;
    for (; frame + kTileFrames <= part.end; frame += kTileFrames) {
      ahead.Step();
      oscillators.AddTile(all, mix + frame * kMostLanes);
      for (; strike < part.batch.count && part.batch.offsets[strike] < frame + kTileFrames;
           ++strike) {
        Strike(part, strike, lane, frame + kTileFrames, mix);
      }
    }
    MoveNewborn(frame);
    if (const size_t rest = part.end - frame; rest > 0) {
      oscillators.AddPart(all, rest, mix + frame * kMostLanes);
      newborn.Multiply(oscillators.Power(rest - 1));
      newborn_at = part.end;
    }
    for (; strike < part.batch.count; ++strike) Strike(part, strike, lane, part.end, mix);
  }

  HWY_INLINE void MoveNewborn(size_t frame) {
    if (any_newborn) oscillators.Advance((frame - newborn_at) / kTileFrames, newborn);
    newborn_at = frame;
  }

  /// A strike that is heard from within the tile that ends at `tile_end`, where the states are.
  HWY_INLINE void Strike(const StruckPart& part, size_t strike, size_t lane, size_t tile_end,
                         float* mix) {
    const size_t offset = part.batch.offsets[strike];
    Z struck;
    struck.Load(part.batch.re(strike, part.lane_count) + lane,
                part.batch.im(strike, part.lane_count) + lane);
    oscillators.AddPart(struck, tile_end - offset, mix + offset * kMostLanes);
    all.Add(struck);
    if (newborn_at != tile_end) MoveNewborn(tile_end);
    newborn.Add(struck);
    any_newborn = true;
  }
};

void Start(LaneArrays& lanes, size_t lane_count) {
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(Floats())) {
    States<1> z;
    z.Load(lanes.re.data() + lane, lanes.im.data() + lane);
    z.Store(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    z.Clear();
    z.Store(lanes.newborn_re.data() + lane, lanes.newborn_im.data() + lane);
  }
}

void RingStruck(LaneArrays& lanes, const StruckPart& part, float* mix) {
  ForVectors(lanes, {0, part.lane_count}, [&](const auto& oscillators, auto ahead, size_t lane) {
    constexpr size_t kVectors = std::decay_t<decltype(oscillators)>::kCount;
    StruckVectors<kVectors, decltype(ahead)> vectors{oscillators, ahead, {}, {}};
    vectors.Load(lanes, lane);
    vectors.Ring(part, lane, mix);
    vectors.Store(lanes, lane);
  });
}

void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re, const float* added_im) {
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(Floats())) {
    const auto add = [&](LaneArray<float>& re, LaneArray<float>& im) {
      States<1> sum, added;
      sum.Load(re.data() + lane, im.data() + lane);
      added.Load(added_re + lane, added_im + lane);
      sum.Add(added);
      sum.Store(re.data() + lane, im.data() + lane);
    };
    add(lanes.start_re, lanes.start_im);
    add(lanes.newborn_re, lanes.newborn_im);
  }
}

/// Advances one vector in double, and adds what is newborn if there is any; returns |Z|^2.
HWY_INLINE hn::Vec<Doubles> AdvanceVector(LaneArrays& lanes, size_t lane, const float* newborn_re,
                                          const float* newborn_im) {
  const Doubles d;
  const HalfFloats df;
  const auto q_re = hn::Load(d, lanes.block_re.data() + lane);
  const auto q_im = hn::Load(d, lanes.block_im.data() + lane);
  const auto old_re = hn::Load(d, lanes.re.data() + lane);
  const auto old_im = hn::Load(d, lanes.im.data() + lane);
  auto re = hn::NegMulAdd(old_im, q_im, hn::Mul(old_re, q_re));
  auto im = hn::MulAdd(old_im, q_re, hn::Mul(old_re, q_im));
  if (newborn_re != nullptr) {
    re = hn::Add(re, hn::PromoteTo(d, hn::Load(df, newborn_re)));
    im = hn::Add(im, hn::PromoteTo(d, hn::Load(df, newborn_im)));
  }
  hn::Store(re, d, lanes.re.data() + lane);
  hn::Store(im, d, lanes.im.data() + lane);
  return hn::MulAdd(re, re, hn::Mul(im, im));
}

/// Advances groups of lanes, ascending, and finds out about the segments that they belong to.
class Advancing {
 public:
  HWY_INLINE Advancing(LaneArrays& lanes, std::span<RingingSegment> segments,
                       double silence_squared)
      : lanes_(lanes), segments_(segments), silence_squared_(silence_squared) {
    Begin();
  }

  /// `newborn_re` and `newborn_im` are of this group, or null.
  HWY_INLINE void AdvanceGroup(size_t lane, const float* newborn_re, const float* newborn_im) {
    while (lane >= segments_.front().range.first + segments_.front().range.count) Next();
    Loudness group;
    group.Clear();
    for (size_t i = 0; i < kMostLanes; i += hn::Lanes(Doubles())) {
      const bool newborn = newborn_re != nullptr;
      group.Note(AdvanceVector(lanes_, lane + i, newborn ? newborn_re + i : nullptr,
                               newborn ? newborn_im + i : nullptr));
    }
    all_.Join(group);
    if (group.Above(silence_squared_)) {
      segments_.front().awake_count = lane + kMostLanes - segments_.front().range.first;
    } else {
      lanes_.Silence({lane, kMostLanes});
    }
  }

  /// Whether everything was finite.
  HWY_INLINE bool Finish() {
    while (!segments_.empty()) Next();
    return finite_;
  }

 private:
  HWY_INLINE void Begin() {
    all_.Clear();
    if (!segments_.empty()) segments_.front().awake_count = 0;
  }
  HWY_INLINE void Next() {
    segments_.front().loudest_squared = all_.Loudest();
    finite_ &= all_.Finite();
    segments_ = segments_.subspan(1);
    Begin();
  }

  LaneArrays& lanes_;
  std::span<RingingSegment> segments_;
  double silence_squared_;
  Loudness all_;
  bool finite_ = true;
};

bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments, const FreeBlock& block,
                float* mix) {
  bool finite = true;
  for (RingingSegment& segment : segments) {
    const LaneRange awake{segment.range.first, segment.awake_count};
    Ring(lanes, awake, block.frame_count, mix);
    Advancing advancing(lanes, {&segment, 1}, block.silence_squared);
    for (size_t group = 0; group < awake.count; group += kMostLanes) {
      advancing.AdvanceGroup(awake.first + group, nullptr, nullptr);
    }
    finite &= advancing.Finish();
  }
  return finite;
}

bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared, float* mix) {
  Advancing advancing(lanes, segments, silence_squared);
  // Of some vectors, or as many as a group has.
  alignas(64) float newborn_re[kVectorsAPass * kMostLanes], newborn_im[kVectorsAPass * kMostLanes];
  ForVectors(lanes, {0, part.lane_count}, [&](const auto& oscillators, auto ahead, size_t lane) {
    constexpr size_t kVectors = std::decay_t<decltype(oscillators)>::kCount;
    StruckVectors<kVectors, decltype(ahead)> vectors{oscillators, ahead, {}, {}};
    if (part.started) {
      vectors.Load(lanes, lane);
    } else {
      vectors.all.Load(lanes.re.data() + lane, lanes.im.data() + lane);
      vectors.newborn.Clear();
    }
    vectors.Ring(part, lane, mix);
    const size_t first = lane % kMostLanes;
    vectors.newborn.Store(newborn_re + first, newborn_im + first);
    const size_t end = first + kVectors * hn::Lanes(Floats());
    for (size_t group = 0; group + kMostLanes <= end; group += kMostLanes) {
      advancing.AdvanceGroup(lane - first + group, newborn_re + group, newborn_im + group);
    }
  });
  return advancing.Finish();
}

/// Kernels add to as many lanes of a frame as their vectors have.
void SumLanes(const float* mix, std::span<float> block) {
  const Floats d;
  for (size_t n = 0; n < block.size(); ++n) {
    block[n] = hn::GetLane(hn::SumOfLanes(d, hn::Load(d, mix + n * kMostLanes)));
  }
}

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace carillon::ring_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::ring_kernel {
HWY_EXPORT(RingFreely);
HWY_EXPORT(Start);
HWY_EXPORT(RingStruck);
HWY_EXPORT(AddStrike);
HWY_EXPORT(FinishStruck);
HWY_EXPORT(SumLanes);
HWY_EXPORT(Target);

bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments, const FreeBlock& block,
                float* mix) noexcept {
  return HWY_DYNAMIC_DISPATCH(RingFreely)(lanes, segments, block, mix);
}

void Start(LaneArrays& lanes, size_t lane_count) noexcept {
  HWY_DYNAMIC_DISPATCH(Start)(lanes, lane_count);
}

void RingStruck(LaneArrays& lanes, const StruckPart& part, float* mix) noexcept {
  HWY_DYNAMIC_DISPATCH(RingStruck)(lanes, part, mix);
}

void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept {
  HWY_DYNAMIC_DISPATCH(AddStrike)(lanes, lane_count, added_re, added_im);
}

bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared, float* mix) noexcept {
  return HWY_DYNAMIC_DISPATCH(FinishStruck)(lanes, segments, part, silence_squared, mix);
}

void SumLanes(const float* mix, std::span<float> block) noexcept {
  HWY_DYNAMIC_DISPATCH(SumLanes)(mix, block);
}

std::string_view Target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace carillon::ring_kernel
#endif
