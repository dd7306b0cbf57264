// SPDX-License-Identifier: Apache-2.0
// The rendering thread's side of a bank.
#include "server/synthesis/bank/oscillator_bank.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "server/synthesis/schedule/work_budget.h"
#include "server/synthesis/spectrum/spectral_kernel.h"

namespace carillon {
namespace {

/// A segment that was struck in this number of consecutive long blocks stays in the time domain,
/// where each impulse brings it back to anyway; the spectrum would be extra work.
constexpr uint32_t kBusyStreak = 4;

}  // namespace

bool OscillatorBank::out_of_spectrum() const noexcept {
  return std::ranges::none_of(
      long_segments_, [](const LongSegment& segment) { return segment.awake || segment.sounding; });
}

bool OscillatorBank::RenderAdd(BlockMix& mix) noexcept {
  RenderAcceleration(mix);
  return RenderModes(mix);
}

bool OscillatorBank::RenderAddInTime(BlockMix& mix) noexcept {
  RenderAcceleration(mix);
  return RenderModesInTime(mix);
}

/// Adds the sound of the body's acceleration. It is computed for the listener's direction already,
/// so both renderings receive it while the gains of the modes move.
void OscillatorBank::RenderAcceleration(BlockMix& mix) noexcept {
  if (moved_ == nullptr || !moved_->active()) return;
  std::array<float, kMostBlockFrames> sound{};
  moved_->RenderAdd(std::span(sound).first(block_frame_count_));
  const auto add = [&](LaneMix& lanes) {
    for (size_t n = 0; n < block_frame_count_; ++n) lanes.frames()[n] += sound[n];
  };
  add(mix.lanes());
  if (gains_move()) add(mix.fading(block_frame_count_));
}

bool OscillatorBank::RenderModes(BlockMix& mix) noexcept {
  if (modes_silent()) return true;
  if (!struck() && !force_.driving()) {
    if (ringing_ != Ringing::kInTime && !mix.any_begins()) {
      block_.phase = Phase::kWaiting;  // a refused onset may have begun the block
      return true;
    }
    BeginBlock(mix);
    return RenderModesInTime(mix);
  }
  BeginStrikes(mix);
  return FinishStruck(mix);
}

bool OscillatorBank::RenderModesInTime(BlockMix& mix) noexcept {
  const auto output = [this](LaneMix& lanes, const ring_kernel::Gains& gains) {
    return ring_kernel::Output{.sums = Sums(lanes.nodes(), block_frame_count_, lanes),
                               .gains = gains};
  };
  ring_kernel::FreeBlock block{
      .output = output(mix.lanes(), gains_ ? gains_->at_end() : ring_kernel::Gains{}),
      .frame_count = block_frame_count_,
      .silence_squared = silence_squared_};
  if (gains_move()) block.second = output(mix.fading(block_frame_count_), gains_->at_begin());
  block_.finite &= ring_kernel::RingFreely(lanes_, segments_, block);
  return EndBlock();
}

bool OscillatorBank::EndBlock() noexcept {
  const bool finite = std::exchange(block_, {}).finite;
  loudness_changed_ = true;
  if (!finite) Silence();
  if (std::exchange(awake_changed_, false) || AwakeCounts() != counted_) CountAwake();
  return finite;
}

OscillatorBank::Counts OscillatorBank::AwakeCounts() const noexcept {
  Counts counts;
  std::ranges::transform(segments_, counts.begin(), &RingingSegment::awake_count);
  return counts;
}

void OscillatorBank::BeginBlock(BlockMix& mix) noexcept {
  if (block_.phase != Phase::kWaiting) return;
  block_.phase = Phase::kBegun;
  for (size_t kind = 0; kind < long_segments_.size(); ++kind) {
    if (mix.begins(kind)) block_.finite &= BeginLongBlock(kind, mix);
  }
}

bool OscillatorBank::BeginLongBlock(size_t kind, BlockMix& mix) noexcept {
  LongSegment& segment = long_segments_[kind];
  const bool struck = std::exchange(segment.struck, false);
  segment.struck_streak = struck ? segment.struck_streak + 1 : 0;
  awake_changed_ |= segment.sounding && !segment.awake;
  segment.sounding = false;
  if (segment.struck_streak >= kBusyStreak || leaving_spectrum_) {
    MoveToTime(kind);
    return true;
  }
  MoveToSpectrum(kind);
  if (!segment.awake) return true;
  const spectral_kernel::Spreading advanced =
      spectral_kernel::Spread(segment.lanes, segment.mode_count, silence_squared_, mix.Slots(kind));
  awake_changed_ |= advanced.fell_asleep;
  segment.awake = segment.sounding = advanced.awake;
  segment.loudest_squared = advanced.loudest_squared;
  return advanced.finite;
}

void OscillatorBank::MoveToSpectrum(size_t kind) noexcept {
  RingingSegment& from = segments_[kind + 1];
  LongSegment& to = long_segments_[kind];
  for (const LaneRun& run : lanes_.runs) {
    if (run.segment != kind + 1) continue;
    const size_t awake_count = run.CountOfFirst(from.awake_count);
    for (size_t i = 0; i < awake_count; ++i) {
      to.lanes.re[run.first_in_segment + i] += lanes_.re[run.range.first + i];
      to.lanes.im[run.first_in_segment + i] += lanes_.im[run.range.first + i];
    }
    lanes_.Silence({run.range.first, awake_count});
  }
  std::fill_n(to.lanes.awake.begin(), from.awake_count / kMostLanes, uint8_t{1});
  to.awake |= from.awake_count > 0;
  from.awake_count = 0;
}

void OscillatorBank::MoveToTime(size_t kind) noexcept {
  LongSegment& from = long_segments_[kind];
  RingingSegment& to = segments_[kind + 1];
  if (!from.awake) return;
  awake_changed_ = true;
  for (const LaneRun& run : lanes_.runs) {
    if (run.segment != kind + 1) continue;
    for (size_t i = 0; i < run.range.count; ++i) {
      lanes_.re[run.range.first + i] += std::exchange(from.lanes.re[run.first_in_segment + i], 0);
      lanes_.im[run.range.first + i] += std::exchange(from.lanes.im[run.first_in_segment + i], 0);
    }
  }
  std::ranges::fill(from.lanes.awake, uint8_t{0});
  from.awake = false;
  to.awake_count = to.lane_count;
}

void OscillatorBank::Silence() noexcept {
  SilenceLanes();
  force_.Silence();
}

void OscillatorBank::SilenceLanes() noexcept {
  if (moved_ != nullptr) moved_->Silence();
  awake_changed_ = true;
  lanes_.Silence({0, lane_count_});
  for (RingingSegment& segment : segments_) segment.awake_count = 0;
  for (LongSegment& segment : long_segments_) {
    std::fill_n(segment.lanes.re.data(), segment.lanes.awake.size() * kMostLanes, 0.0);
    std::fill_n(segment.lanes.im.data(), segment.lanes.awake.size() * kMostLanes, 0.0);
    std::ranges::fill(segment.lanes.awake, uint8_t{0});
    segment.awake = segment.sounding = false;
  }
}

bool OscillatorBank::BoundLoudness() noexcept {
  if (!std::exchange(loudness_changed_, false)) return false;
  const double loudest = loudest_squared();
  if (!(loudest > kMostAmplitude * kMostAmplitude)) return false;
  const double factor = kMostAmplitude / std::sqrt(loudest);
  const auto lower = [factor](LaneArray<double>& states, size_t count) {
    for (size_t i = 0; i < count; ++i) states[i] *= factor;
  };
  lower(lanes_.re, lane_count_);
  lower(lanes_.im, lane_count_);
  for (RingingSegment& segment : segments_) segment.loudest_squared *= factor * factor;
  for (LongSegment& segment : long_segments_) {
    lower(segment.lanes.re, segment.lanes.awake.size() * kMostLanes);
    lower(segment.lanes.im, segment.lanes.awake.size() * kMostLanes);
    segment.loudest_squared *= factor * factor;
  }
  return true;
}

double OscillatorBank::ringing_work() const noexcept {
  if (gains_ == nullptr) return ringing_work_;
  // While the gains move, the lanes are rendered twice.
  return 2 * ringing_work_ + work::kDirectedTerm * static_cast<double>(gains_->terms_per_block());
}

double OscillatorBank::strike_work() const noexcept {
  return work::kStrike + work::kStrikeLane * static_cast<double>(lane_count_);
}

double OscillatorBank::merged_strike_work() const noexcept {
  return work::kMergedStrike + work::kMergedLane * static_cast<double>(lane_count_);
}

double OscillatorBank::awakening_work() const noexcept {
  size_t asleep_count = lane_count_;
  for (const RingingSegment& segment : segments_) asleep_count -= segment.awake_count;
  if (gains_ == nullptr) return TimeWork(asleep_count);
  return 2 * TimeWork(asleep_count) +
         work::kDirectedTerm * static_cast<double>(gains_->term_count());
}

double OscillatorBank::TimeWork(size_t lane_count) const noexcept {
  return work::kTimeLane * static_cast<double>(lane_count * block_frame_count_) / 128;
}

double OscillatorBank::loudest_squared() const noexcept {
  double loudest = 0;
  for (const RingingSegment& segment : segments_) {
    if (segment.awake_count > 0) loudest = std::max(loudest, segment.loudest_squared);
  }
  for (const LongSegment& segment : long_segments_) {
    if (segment.awake) loudest = std::max(loudest, segment.loudest_squared);
  }
  return loudest;
}

void OscillatorBank::CountAwake() noexcept {
  counted_ = AwakeCounts();
  active_mode_count_ = 0;
  ringing_work_ = 0;
  ringing_ = Ringing::kNowhere;
  auto mode_count = group_mode_counts_.begin();
  for (size_t part = 0; part < segments_.size(); ++part) {
    const RingingSegment& segment = segments_[part];
    const LongSegment* by_spectrum = part == 0 ? nullptr : &long_segments_[part - 1];
    if (segment.awake_count > 0) ringing_ = Ringing::kInTime;
    ringing_work_ += TimeWork(segment.awake_count);
    if (by_spectrum != nullptr && by_spectrum->awake) {
      ringing_work_ += work::kSpectralLane * static_cast<double>(by_spectrum->mode_count) /
                       static_cast<double>(by_spectrum->block_count);
    }
    if (by_spectrum != nullptr && (by_spectrum->awake || by_spectrum->sounding)) {
      ringing_ = std::max(ringing_, Ringing::kInSpectrum);
    }
    for (size_t i = 0; i < segment.lane_count; i += kMostLanes, ++mode_count) {
      const bool awake = i < segment.awake_count ||
                         (by_spectrum != nullptr && by_spectrum->lanes.awake[i / kMostLanes] != 0);
      if (awake) active_mode_count_ += *mode_count;
    }
  }
}

std::string_view SimdTarget() { return ring_kernel::Target(); }

}  // namespace carillon
