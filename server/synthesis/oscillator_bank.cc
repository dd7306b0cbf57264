// SPDX-License-Identifier: Apache-2.0
// The rendering thread's side of a bank.
#include "server/synthesis/oscillator_bank.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "server/synthesis/spectral_kernel.h"
#include "server/synthesis/work_budget.h"

namespace carillon {
namespace {

/// A bank that was struck in so many long blocks on end rings in the time domain as a whole: by
/// spectrum it would cost that and the spectrum too.
constexpr uint32_t kBusyStreak = 4;

/// Of the triangle's.
size_t NearestVertex(const Excitation& excitation) {
  return static_cast<size_t>(std::ranges::max_element(excitation.weights) -
                             excitation.weights.begin());
}

double Norm(const std::array<float, 3>& vector) {
  return std::hypot(vector[0], vector[1], vector[2]);
}

}  // namespace

bool OscillatorBank::out_of_spectrum() const noexcept {
  return std::ranges::none_of(
      long_segments_, [](const LongSegment& segment) { return segment.awake || segment.sounding; });
}

std::optional<strike_kernel::Projection> OscillatorBank::Project(
    const Excitation& excitation) const noexcept {
  strike_kernel::Projection projection{.column_count = column_count_};
  for (size_t i = 0; i < 3; ++i) {
    if (excitation.vertices[i] >= shapes_.vertex_count()) return std::nullopt;
    AddVertex(excitation.vertices[i], excitation.weights[i], excitation, projection);
  }
  return projection;
}

void OscillatorBank::AddVertex(size_t vertex, float weight, const Excitation& excitation,
                               strike_kernel::Projection& projection) const noexcept {
  for (size_t axis = 0; axis < 3; ++axis) {
    projection.rows[projection.row_count] = shapes_.Row(vertex, axis) + first_column_;
    projection.factors[projection.row_count++] = weight * excitation.impulse_newton_seconds[axis];
  }
}

StrikeBatch::RowsAhead OscillatorBank::RowsOf(std::span<const DueStrike> strikes) const noexcept {
  StrikeBatch::RowsAhead ahead{.value_count = 3 * shapes_.stride()};
  for (const DueStrike& strike : strikes) {
    const Excitation& excitation = strike.strike->excitation;
    const size_t nearest = NearestVertex(excitation);
    for (size_t i = 0; i < 3; ++i) {
      const size_t vertex = excitation.vertices[i];
      if (vertex >= shapes_.vertex_count() || (strike.merged && i != nearest)) continue;
      ahead.rows[ahead.count++] = shapes_.Row(vertex, 0);
      if (ahead.count == ahead.rows.size()) return ahead;
    }
  }
  return ahead;
}

bool OscillatorBank::StrikeMerged(std::span<const DueStrike> strikes, BlockMix& mix) noexcept {
  float* modal_impulses = mix.batch().modal_impulses();
  strike_kernel::Projection projection{.column_count = column_count_};
  double weight_sum = 0, time_sum = 0, tau_squared_sum = 0;
  for (const DueStrike& due : strikes) {
    const Excitation& excitation = due.strike->excitation;
    const size_t nearest = NearestVertex(excitation);
    if (excitation.vertices[nearest] >= shapes_.vertex_count()) continue;
    const double weight = Norm(excitation.impulse_newton_seconds);
    weight_sum += weight;
    time_sum += weight * (due.offset - double{due.strike->lead_frames});
    tau_squared_sum += weight * excitation.tau_s * excitation.tau_s;
    AddVertex(excitation.vertices[nearest], 1, excitation, projection);
    if (projection.row_count < projection.rows.size()) continue;
    strike_kernel::Project(projection, modal_impulses);
    projection.row_count = 0;
    projection.add = true;
  }
  if (!(weight_sum > 0)) return false;
  if (projection.row_count > 0) strike_kernel::Project(projection, modal_impulses);
  const size_t end = (strikes.front().offset / kMergedFrames + 1) * kMergedFrames;
  const size_t offset = std::min(end, block_frame_count_) - 1;
  const double lead_frames = static_cast<double>(offset) - time_sum / weight_sum;
  return StrikeModes({modal_impulses, column_count_}, offset,
                     {.lead_frames = static_cast<float>(std::max(lead_frames, 0.0)),
                      .tau_s = static_cast<float>(std::sqrt(tau_squared_sum / weight_sum))},
                     mix);
}

bool OscillatorBank::Strike(const Excitation& excitation, size_t offset, float lead_frames,
                            BlockMix& mix) noexcept {
  const std::optional<strike_kernel::Projection> projection = Project(excitation);
  if (!projection) return false;
  float* modal_impulses = mix.batch().modal_impulses();
  strike_kernel::Project(*projection, modal_impulses);
  return StrikeModes({modal_impulses, column_count_}, offset,
                     {.lead_frames = lead_frames, .tau_s = excitation.tau_s}, mix);
}

bool OscillatorBank::StrikeModes(std::span<const float> modal_impulses, size_t offset,
                                 const strike_kernel::Onset& onset, BlockMix& mix) noexcept {
  assert(modal_impulses.size() == column_count_);
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  offset = NotBeforeTheLast(offset, batch);
  if (batch.count == StrikeBatch::Capacity(lane_count_)) RenderStrikes(offset, mix);
  const bool finite =
      strike_kernel::Excite(lanes_, lane_count_, modal_impulses.data(), onset, batch.ahead,
                            batch.re(batch.count, lane_count_), batch.im(batch.count, lane_count_));
  if (finite) batch.offsets[batch.count++] = offset;
  newborn_ = newborn_ || finite;
  begun_ = begun_ && !silent();  // a silent bank is not rendered in this block
  return finite;
}

bool OscillatorBank::Gather(const Excitation& force) noexcept {
  const std::optional<strike_kernel::Projection> projection = Project(force);
  if (projection) force_.Gather(*projection);
  return projection.has_value();
}

bool OscillatorBank::Tie(const ForceKnot& knot, size_t offset, BlockMix& mix) noexcept {
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  const bool silent_before = silent();
  offset = NotBeforeTheLast(offset, batch);
  RenderStrikes(offset, mix);
  const bool finite = force_.Tie(knot, lanes_, batch.re(0, lane_count_), batch.im(0, lane_count_));
  if (finite) batch.offsets[batch.count++] = offset;
  newborn_ = newborn_ || finite || !silent_before;
  begun_ = begun_ && !silent();
  return finite;
}

size_t OscillatorBank::NotBeforeTheLast(size_t offset, const StrikeBatch& batch) const noexcept {
  return std::max(offset, batch.count > 0 ? batch.offsets[batch.count - 1] : rendered_to_);
}

void OscillatorBank::BeginStrikes(BlockMix& mix) noexcept {
  BeginBlock(mix);
  if (newborn_) return;
  mix.batch().count = rendered_to_ = 0;
  started_ = false;
}

/// The part of the block up to `end`, with what the batch holds.
ring_kernel::StruckPart OscillatorBank::NextPart(size_t end, BlockMix& mix) const noexcept {
  return {.begin = rendered_to_,
          .end = end,
          .started = started_,
          .batch = mix.batch(),
          .lane_count = lane_count_};
}

/// Renders what must be rendered before more can happen in this block.
void OscillatorBank::RenderStrikes(size_t end, BlockMix& mix) noexcept {
  if (!started_) ring_kernel::Start(lanes_, lane_count_);
  started_ = true;
  if (force_.driving()) return RenderDrivenStrikes(end, mix);
  ring_kernel::RingStruck(lanes_, NextPart(end, mix), mix.lanes().lanes());
  mix.batch().count = 0;
  rendered_to_ = end;
}

void OscillatorBank::RenderDrivenStrikes(size_t end, BlockMix& mix) noexcept {
  StrikeBatch& batch = mix.batch();
  for (size_t i = 0; i < batch.count; ++i) {
    RenderDriven(batch.offsets[i], mix.lanes());
    ring_kernel::AddStrike(lanes_, lane_count_, batch.re(i, lane_count_), batch.im(i, lane_count_));
  }
  batch.count = 0;
  RenderDriven(end, mix.lanes());
}

void OscillatorBank::RenderDriven(size_t end, LaneMix& mix) noexcept {
  force_.Render(end - rendered_to_, lanes_, mix.lanes() + rendered_to_ * kMostLanes);
  rendered_to_ = end;
}

bool OscillatorBank::RenderAdd(BlockMix& mix) noexcept {
  if (silent()) return true;
  if (!newborn_ && !force_.driving()) {
    if (!awake_in_time_ && !mix.any_begins()) return true;
    BeginBlock(mix);
    return RenderAddInTime(mix.lanes());
  }
  BeginStrikes(mix);
  return FinishStruck(mix);
}

bool OscillatorBank::FinishStruck(BlockMix& mix) noexcept {
  if (force_.driving()) RenderStrikes(block_frame_count_, mix);
  finite_ &= ring_kernel::FinishStruck(lanes_, segments_, NextPart(block_frame_count_, mix),
                                       silence_squared_, mix.lanes().lanes());
  for (LongSegment& segment : long_segments_) segment.struck = true;
  newborn_ = false;
  rendered_to_ = 0;
  return EndBlock();
}

bool OscillatorBank::RenderAddInTime(LaneMix& mix) noexcept {
  finite_ &= ring_kernel::RingFreely(
      lanes_, segments_, {.frame_count = block_frame_count_, .silence_squared = silence_squared_},
      mix.lanes());
  return EndBlock();
}

bool OscillatorBank::EndBlock() noexcept {
  begun_ = false;
  if (!finite_) Silence();
  if (std::exchange(changed_, false) || AwakeCounts() != counted_) CountAwake();
  return std::exchange(finite_, true);
}

OscillatorBank::Counts OscillatorBank::AwakeCounts() const noexcept {
  Counts counts;
  std::ranges::transform(segments_, counts.begin(), &RingingSegment::awake_count);
  return counts;
}

void OscillatorBank::BeginBlock(BlockMix& mix) noexcept {
  if (std::exchange(begun_, true)) return;
  for (size_t kind = 0; kind < long_segments_.size(); ++kind) {
    if (mix.begins(kind)) finite_ &= BeginLongBlock(kind, mix);
  }
}

bool OscillatorBank::BeginLongBlock(size_t kind, BlockMix& mix) noexcept {
  LongSegment& segment = long_segments_[kind];
  const bool struck = std::exchange(segment.struck, false);
  segment.struck_streak = struck ? segment.struck_streak + 1 : 0;
  changed_ |= segment.sounding && !segment.awake;
  segment.sounding = false;
  if (segment.struck_streak >= kBusyStreak || leaving_spectrum_) {
    MoveToTime(kind);
    return true;
  }
  MoveToSpectrum(kind);
  if (!segment.awake) return true;
  const spectral_kernel::Spreading advanced =
      spectral_kernel::Spread(segment.lanes, segment.mode_count, silence_squared_, mix.Slots(kind));
  changed_ |= advanced.fell_asleep;
  segment.awake = segment.sounding = advanced.awake;
  segment.loudest_squared = advanced.loudest_squared;
  return advanced.finite;
}

void OscillatorBank::MoveToSpectrum(size_t kind) noexcept {
  RingingSegment& from = segments_[kind + 1];
  LongSegment& to = long_segments_[kind];
  for (size_t lane = 0; lane < from.awake_count; ++lane) {
    to.lanes.re[lane] += lanes_.re[from.range.first + lane];
    to.lanes.im[lane] += lanes_.im[from.range.first + lane];
  }
  std::fill_n(to.lanes.awake.begin(), from.awake_count / kMostLanes, uint8_t{1});
  to.awake |= from.awake_count > 0;
  lanes_.Silence({from.range.first, from.awake_count});
  from.awake_count = 0;
}

void OscillatorBank::MoveToTime(size_t kind) noexcept {
  LongSegment& from = long_segments_[kind];
  RingingSegment& to = segments_[kind + 1];
  if (!from.awake) return;
  changed_ = true;
  for (size_t i = 0; i < to.range.count; ++i) {
    const size_t lane = to.range.first + i;
    lanes_.re[lane] += std::exchange(from.lanes.re[i], 0);
    lanes_.im[lane] += std::exchange(from.lanes.im[i], 0);
  }
  std::ranges::fill(from.lanes.awake, uint8_t{0});
  from.awake = false;
  to.awake_count = to.range.count;
}

void OscillatorBank::Silence() noexcept {
  changed_ = true;
  lanes_.Silence({0, lane_count_});
  force_.Silence();
  for (RingingSegment& segment : segments_) segment.awake_count = 0;
  for (LongSegment& segment : long_segments_) {
    std::fill_n(segment.lanes.re.data(), segment.lanes.awake.size() * kMostLanes, 0.0);
    std::fill_n(segment.lanes.im.data(), segment.lanes.awake.size() * kMostLanes, 0.0);
    std::ranges::fill(segment.lanes.awake, uint8_t{0});
    segment.awake = segment.sounding = false;
  }
}

double OscillatorBank::strike_work() const noexcept {
  return work::kStrikeLane * static_cast<double>(lane_count_);
}

double OscillatorBank::merged_strike_work() const noexcept {
  return work::kMergedLane * static_cast<double>(lane_count_);
}

double OscillatorBank::awakening_work() const noexcept {
  size_t asleep_count = lane_count_;
  for (const RingingSegment& segment : segments_) asleep_count -= segment.awake_count;
  return TimeWork(asleep_count);
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
  any_awake_ = awake_in_time_ = false;
  for (size_t part = 0; part < segments_.size(); ++part) {
    const RingingSegment& segment = segments_[part];
    const LongSegment* by_spectrum = part == 0 ? nullptr : &long_segments_[part - 1];
    awake_in_time_ |= segment.awake_count > 0;
    ringing_work_ += TimeWork(segment.awake_count);
    if (by_spectrum != nullptr && by_spectrum->awake) {
      ringing_work_ += work::kSpectralLane * static_cast<double>(by_spectrum->mode_count) /
                       static_cast<double>(by_spectrum->block_count);
    }
    if (by_spectrum != nullptr) any_awake_ |= by_spectrum->awake || by_spectrum->sounding;
    for (size_t i = 0; i < segment.range.count; i += kMostLanes) {
      const bool awake = i < segment.awake_count ||
                         (by_spectrum != nullptr && by_spectrum->lanes.awake[i / kMostLanes] != 0);
      if (awake) active_mode_count_ += group_mode_counts_[(segment.range.first + i) / kMostLanes];
    }
  }
  any_awake_ |= awake_in_time_;
}

std::string_view SimdTarget() { return ring_kernel::Target(); }

}  // namespace carillon
