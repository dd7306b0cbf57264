// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/ring_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/ringing/ring_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "server/synthesis/ringing/lane_vectors-inl.h"
#include "server/synthesis/ringing/oscillators-inl.h"
#include "server/synthesis/ringing/passes-inl.h"
#include "server/synthesis/ringing/struck_vectors-inl.h"
// clang-format on

#include <algorithm>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace carillon::ring_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using carillon::HWY_NAMESPACE::ApplyGains;
using carillon::HWY_NAMESPACE::Doubles;
using carillon::HWY_NAMESPACE::Floats;
using carillon::HWY_NAMESPACE::ForVectors;
using carillon::HWY_NAMESPACE::HalfFloats;
using carillon::HWY_NAMESPACE::kMostSquared;
using carillon::HWY_NAMESPACE::kVectorsPerPass;
using carillon::HWY_NAMESPACE::Loudness;
using carillon::HWY_NAMESPACE::Manner;
using carillon::HWY_NAMESPACE::States;
using carillon::HWY_NAMESPACE::StruckVectors;
using carillon::HWY_NAMESPACE::V;

void Ring(const LaneArrays& lanes, LaneRange range, size_t tile_kind, size_t frame_count,
          const Output& output) {
  ForVectors(lanes, range, {.tile_kind = tile_kind},
             [&](const auto& oscillators, auto ahead, size_t lane) {
               typename std::decay_t<decltype(oscillators)>::Z z;
               z.Load(lanes.re.data() + lane, lanes.im.data() + lane);
               ApplyGains(output.gains, lane, z);
               const size_t kind = oscillators.tile_kind;
               float* sum = output.sums[kind];
               if (kind > 0) {
                 for (size_t frame = 0; frame < frame_count; frame += kTileFrames[kind]) {
                   ahead.Step(kind);
                   oscillators.AddClosedTile(z, sum);
                   sum += kNodeFloats;
                 }
                 return;
               }
               size_t frame = 0;
               for (; frame + kTileFrames[0] <= frame_count; frame += kTileFrames[0]) {
                 ahead.Step(0);
                 oscillators.AddTile(z, sum + frame * kMostLanes);
               }
               oscillators.AddPart(z, frame_count - frame, sum + frame * kMostLanes);
             });
}

void Start(LaneArrays& lanes, size_t lane_count) {
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(Floats())) {
    States<1> z;
    z.Load(lanes.re.data() + lane, lanes.im.data() + lane);
    z.Store(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    z.Clear();
    z.Store(lanes.fresh_re.data() + lane, lanes.fresh_im.data() + lane);
  }
}

Manner MannerOf(const StruckPart& part) {
  return {.by_frames = part.by_frames, .frame_count = part.end - part.begin};
}

void RingStruck(LaneArrays& lanes, const StruckPart& part) {
  ForVectors(lanes, MannerOf(part), [&](const auto& oscillators, auto ahead, size_t lane) {
    constexpr size_t kVectors = std::decay_t<decltype(oscillators)>::kCount;
    StruckVectors<kVectors, decltype(ahead)> vectors(oscillators, ahead);
    vectors.Load(lanes, lane);
    vectors.Ring(part, lane);
    vectors.Store(lanes, lane);
  });
}

void HearStruck(const LaneArrays& lanes, const StruckPart& part) {
  const auto hear = [&](const auto& re, const auto& im) {
    ForVectors(lanes, MannerOf(part), [&](const auto& oscillators, auto ahead, size_t lane) {
      constexpr size_t kVectors = std::decay_t<decltype(oscillators)>::kCount;
      StruckVectors<kVectors, decltype(ahead)> vectors(oscillators, ahead);
      vectors.all.Load(re.data() + lane, im.data() + lane);
      ApplyGains(part.gains, lane, vectors.all);
      vectors.fresh.Clear();
      vectors.Ring(part, lane);
    });
  };
  if (part.started) {
    hear(lanes.start_re, lanes.start_im);
  } else {
    hear(lanes.re, lanes.im);
  }
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
    add(lanes.fresh_re, lanes.fresh_im);
  }
}

/// Advances one vector in double and adds the fresh state unless it is null; returns |Z|^2.
HWY_INLINE hn::Vec<Doubles> AdvanceVector(LaneArrays& lanes, size_t lane, const float* fresh_re,
                                          const float* fresh_im) {
  const Doubles d;
  const HalfFloats df;
  const auto q_re = hn::Load(d, lanes.block_re.data() + lane);
  const auto q_im = hn::Load(d, lanes.block_im.data() + lane);
  const auto old_re = hn::Load(d, lanes.re.data() + lane);
  const auto old_im = hn::Load(d, lanes.im.data() + lane);
  auto re = hn::NegMulAdd(old_im, q_im, hn::Mul(old_re, q_re));
  auto im = hn::MulAdd(old_im, q_re, hn::Mul(old_re, q_im));
  if (fresh_re != nullptr) {
    re = hn::Add(re, hn::PromoteTo(d, hn::Load(df, fresh_re)));
    im = hn::Add(im, hn::PromoteTo(d, hn::Load(df, fresh_im)));
  }
  hn::Store(re, d, lanes.re.data() + lane);
  hn::Store(im, d, lanes.im.data() + lane);
  return hn::MulAdd(re, re, hn::Mul(im, im));
}

/// Advances groups of lanes in ascending order, and updates the segments that they belong to.
class Advancing {
 public:
  HWY_INLINE Advancing(LaneArrays& lanes, std::span<RingingSegment> segments,
                       double silence_squared)
      : lanes_(lanes), segments_(segments), runs_(lanes.runs), silence_squared_(silence_squared) {
    for (RingingSegment& segment : segments) {
      segment.awake_count = 0;
      segment.loudest_squared = 0;
    }
    all_.Clear();
  }

  /// `fresh_re` and `fresh_im` are the group's fresh states, or null.
  HWY_INLINE void AdvanceGroup(size_t lane, const float* fresh_re, const float* fresh_im) {
    while (lane >= runs_.front().range.first + runs_.front().range.count) Next();
    Loudness group;
    group.Clear();
    for (size_t i = 0; i < kMostLanes; i += hn::Lanes(Doubles())) {
      const bool fresh = fresh_re != nullptr;
      group.Note(AdvanceVector(lanes_, lane + i, fresh ? fresh_re + i : nullptr,
                               fresh ? fresh_im + i : nullptr));
    }
    all_.Join(group);
    if (group.Above(silence_squared_)) {
      awake_count_ = lane + kMostLanes - runs_.front().range.first;
    } else {
      lanes_.Silence({lane, kMostLanes});
    }
  }

  /// Whether everything was finite.
  HWY_INLINE bool Finish() {
    while (!runs_.empty()) Next();
    return finite_;
  }

 private:
  HWY_INLINE void Next() {
    const LaneRun& run = runs_.front();
    RingingSegment& segment = segments_[run.segment];
    segment.loudest_squared = std::max(segment.loudest_squared, all_.Loudest());
    if (awake_count_ > 0) {
      segment.awake_count = std::max(segment.awake_count, run.first_in_segment + awake_count_);
    }
    finite_ &= all_.Finite();
    runs_ = runs_.subspan(1);
    awake_count_ = 0;
    all_.Clear();
  }

  LaneArrays& lanes_;
  std::span<RingingSegment> segments_;
  std::span<const LaneRun> runs_;  // from this one on
  double silence_squared_;
  size_t awake_count_ = 0;  // of this run
  Loudness all_;
  bool finite_ = true;
};

bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments, const FreeBlock& block) {
  std::array<size_t, kMostSegments> awake_counts;
  std::ranges::transform(segments, awake_counts.begin(), &RingingSegment::awake_count);
  Advancing advancing(lanes, segments, block.silence_squared);
  for (const LaneRun& run : lanes.runs) {
    const LaneRange awake{run.range.first, run.CountOfFirst(awake_counts[run.segment])};
    Ring(lanes, awake, run.tile_kind, block.frame_count, block.output);
    if (block.second.sums[0] != nullptr) {
      Ring(lanes, awake, run.tile_kind, block.frame_count, block.second);
    }
    for (size_t group = 0; group < awake.count; group += kMostLanes) {
      advancing.AdvanceGroup(awake.first + group, nullptr, nullptr);
    }
  }
  return advancing.Finish();
}

bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared) {
  Advancing advancing(lanes, segments, silence_squared);
  // Fresh states of one pass, or of a group that takes several passes.
  alignas(64) float fresh_re[kVectorsPerPass * kMostLanes], fresh_im[kVectorsPerPass * kMostLanes];
  ForVectors(lanes, MannerOf(part), [&](const auto& oscillators, auto ahead, size_t lane) {
    constexpr size_t kVectors = std::decay_t<decltype(oscillators)>::kCount;
    StruckVectors<kVectors, decltype(ahead)> vectors(oscillators, ahead);
    if (part.started) {
      vectors.Load(lanes, lane);
    } else {
      vectors.all.Load(lanes.re.data() + lane, lanes.im.data() + lane);
      vectors.fresh.Clear();
    }
    vectors.Ring(part, lane);
    const size_t first = lane % kMostLanes;
    vectors.fresh.Store(fresh_re + first, fresh_im + first);
    const size_t end = first + kVectors * hn::Lanes(Floats());
    for (size_t group = 0; group + kMostLanes <= end; group += kMostLanes) {
      advancing.AdvanceGroup(lane - first + group, fresh_re + group, fresh_im + group);
    }
  });
  return advancing.Finish();
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
HWY_EXPORT(HearStruck);
HWY_EXPORT(AddStrike);
HWY_EXPORT(FinishStruck);
HWY_EXPORT(Target);

bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments,
                const FreeBlock& block) noexcept {
  return HWY_DYNAMIC_DISPATCH(RingFreely)(lanes, segments, block);
}

void Start(LaneArrays& lanes, size_t lane_count) noexcept {
  HWY_DYNAMIC_DISPATCH(Start)(lanes, lane_count);
}

void RingStruck(LaneArrays& lanes, const StruckPart& part) noexcept {
  HWY_DYNAMIC_DISPATCH(RingStruck)(lanes, part);
}

void HearStruck(const LaneArrays& lanes, const StruckPart& part) noexcept {
  HWY_DYNAMIC_DISPATCH(HearStruck)(lanes, part);
}

void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept {
  HWY_DYNAMIC_DISPATCH(AddStrike)(lanes, lane_count, added_re, added_im);
}

bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared) noexcept {
  return HWY_DYNAMIC_DISPATCH(FinishStruck)(lanes, segments, part, silence_squared);
}

std::string_view Target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace carillon::ring_kernel
#endif
