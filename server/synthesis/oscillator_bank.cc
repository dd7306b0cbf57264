// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/oscillator_bank.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <utility>

#include "server/synthesis/bank_kernel.h"
#include "server/synthesis/lane_plan.h"
#include "server/synthesis/work_budget.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;

/// A bank that was struck in so many long blocks on end rings in the time domain as a whole: by
/// spectrum it would cost that and the spectrum too.
constexpr uint32_t kBusyStreak = 4;

uint32_t FirstColumn(const SoundingModes& sounding) {
  return sounding.modes.empty() ? 0 : sounding.modes.front().column;
}

size_t CountColumns(const SoundingModes& sounding) {
  return sounding.modes.empty() ? 0
                                : sounding.modes.back().column - FirstColumn(sounding) + size_t{1};
}

size_t CountLanes(const LanePlan& plan) {
  size_t count = 0;
  for (size_t part = 0; part < plan.lanes.size(); ++part) count += plan.PaddedCount(part);
  return count;
}

void Set(LaneArray<float>& re, LaneArray<float>& im, size_t lane, Complex value) {
  re[lane] = static_cast<float>(value.real());
  im[lane] = static_cast<float>(value.imag());
}

void WriteLane(const PlannedLane& planned, uint32_t first_column, size_t block_frame_count,
               size_t lane, LaneArrays& lanes) {
  for (size_t k = 0; k < kTileFrames; ++k) {
    const Complex power = std::exp(planned.log_q * static_cast<double>(k + 1));
    const size_t index = LaneArrays::PowerIndex(lane, k);
    lanes.powers[index] = static_cast<float>(power.real());
    lanes.powers[index + kMostLanes] = static_cast<float>(power.imag());
  }
  const Complex block = std::exp(planned.log_q * static_cast<double>(block_frame_count));
  lanes.block_re[lane] = block.real();
  lanes.block_im[lane] = block.imag();
  Set(lanes.gain_re, lanes.gain_im, lane, planned.start);
  Set(lanes.lead_re, lanes.lead_im, lane, planned.log_q);
  Set(lanes.tau_re, lanes.tau_im, lane, planned.gaussian_exponent);
  lanes.column[lane] = planned.column - first_column;
}

SpectralLanes MakeSpectralLanes(const std::vector<PlannedLane>& planned, size_t padded_count,
                                const LongBlock& block) {
  SpectralLanes lanes(padded_count);
  for (size_t lane = 0; lane < planned.size(); ++lane) {
    const Complex q = std::exp(planned[lane].log_q * static_cast<double>(block.frame_count));
    lanes.block_re[lane] = q.real();
    lanes.block_im[lane] = q.imag();
    lanes.slot[lane] = static_cast<uint32_t>(planned[lane].spread.slot);
    for (size_t k = 0; k < kSpreadBins; ++k) {
      lanes.weights[2 * (lane * kSpreadBins + k)] = planned[lane].spread.weights[k].real();
      lanes.weights[2 * (lane * kSpreadBins + k) + 1] = planned[lane].spread.weights[k].imag();
    }
  }
  return lanes;
}

/// Of the triangle's.
size_t NearestVertex(const Excitation& excitation) {
  return static_cast<size_t>(std::ranges::max_element(excitation.weights) -
                             excitation.weights.begin());
}

double Norm(const std::array<float, 3>& vector) {
  return std::hypot(vector[0], vector[1], vector[2]);
}

}  // namespace

OscillatorBank::OscillatorBank(const SoundingModes& sounding, const ShapeTable& shapes,
                               const OscillatorBankSettings& settings)
    : OscillatorBank(PlanLanes(sounding, shapes,
                               {.sample_rate_hz = settings.sample_rate_hz,
                                .block_frame_count = settings.block_frame_count,
                                .gain = settings.gain}),
                     sounding, shapes, settings) {}

OscillatorBank::OscillatorBank(const LanePlan& plan, const SoundingModes& sounding,
                               ShapeTable shapes, const OscillatorBankSettings& settings)
    : shapes_(std::move(shapes)),
      block_frame_count_(settings.block_frame_count),
      silence_squared_(settings.silence * settings.silence),
      mode_count_(sounding.modes.size()),
      lane_count_(CountLanes(plan)),
      first_column_(FirstColumn(sounding)),
      column_count_(CountColumns(sounding)),
      lanes_(lane_count_),
      force_(lane_count_, column_count_, settings.sample_rate_hz, settings.noise_seed) {
  assert(block_frame_count_ > 0 && block_frame_count_ <= kMostBlockFrames);
  assert(first_column_ + column_count_ <= shapes_.mode_count());
  assert(lane_count_ <= StrikeBatch::kMostBankLanes);
  assert(column_count_ <= StrikeBatch::kMostBankLanes);
  const double lowest_rad_per_s =
      sounding.modes.empty() ? 1 : sounding.modes.front().damped_rad_per_s;
  group_mode_counts_.resize(lane_count_ / kMostLanes);
  const auto long_blocks = MakeLongBlocks(block_frame_count_);
  size_t lane = 0;
  for (size_t part = 0; part < plan.lanes.size(); ++part) {
    const std::vector<PlannedLane>& planned = plan.lanes[part];
    segments_[part].range = {lane, plan.PaddedCount(part)};
    for (size_t i = 0; i < planned.size(); ++i) {
      WriteLane(planned[i], first_column_, block_frame_count_, lane + i, lanes_);
      force_.SetLane(lane + i, planned[i].start, planned[i].log_q * settings.sample_rate_hz,
                     lowest_rad_per_s);
      if (!planned[i].companion) ++group_mode_counts_[(lane + i) / kMostLanes];
    }
    lane += plan.PaddedCount(part);
    if (part == 0) continue;
    long_segments_.push_back(
        {.lanes = MakeSpectralLanes(planned, plan.PaddedCount(part), long_blocks[part - 1]),
         .mode_count = planned.size(),
         .block_count = long_blocks[part - 1].block_count});
  }
  MeasureBlow(plan);
}

bool OscillatorBank::out_of_spectrum() const noexcept {
  return std::ranges::none_of(
      long_segments_, [](const LongSegment& segment) { return segment.awake || segment.sounding; });
}

std::optional<bank_kernel::Projection> OscillatorBank::Project(
    const Excitation& excitation) const noexcept {
  bank_kernel::Projection projection{.column_count = column_count_};
  for (size_t i = 0; i < 3; ++i) {
    if (excitation.vertices[i] >= shapes_.vertex_count()) return std::nullopt;
    AddVertex(excitation.vertices[i], excitation.weights[i], excitation, projection);
  }
  return projection;
}

void OscillatorBank::AddVertex(size_t vertex, float weight, const Excitation& excitation,
                               bank_kernel::Projection& projection) const noexcept {
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
  bank_kernel::Projection projection{.column_count = column_count_};
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
    bank_kernel::Project(projection, modal_impulses);
    projection.row_count = 0;
    projection.add = true;
  }
  if (!(weight_sum > 0)) return false;
  if (projection.row_count > 0) bank_kernel::Project(projection, modal_impulses);
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
  const std::optional<bank_kernel::Projection> projection = Project(excitation);
  if (!projection) return false;
  float* modal_impulses = mix.batch().modal_impulses();
  bank_kernel::Project(*projection, modal_impulses);
  return StrikeModes({modal_impulses, column_count_}, offset,
                     {.lead_frames = lead_frames, .tau_s = excitation.tau_s}, mix);
}

bool OscillatorBank::StrikeModes(std::span<const float> modal_impulses, size_t offset,
                                 const bank_kernel::Onset& onset, BlockMix& mix) noexcept {
  assert(modal_impulses.size() == column_count_);
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  offset = NotBeforeTheLast(offset, batch);
  if (batch.count == StrikeBatch::Capacity(lane_count_)) RenderStrikes(offset, mix);
  const bool finite =
      bank_kernel::Excite(lanes_, lane_count_, modal_impulses.data(), onset, batch.ahead,
                          batch.re(batch.count, lane_count_), batch.im(batch.count, lane_count_));
  if (finite) batch.offsets[batch.count++] = offset;
  newborn_ = newborn_ || finite;
  begun_ = begun_ && !silent();  // a silent bank is not rendered in this block
  return finite;
}

bool OscillatorBank::Gather(const Excitation& force) noexcept {
  const std::optional<bank_kernel::Projection> projection = Project(force);
  if (projection) force_.Gather(*projection);
  return projection.has_value();
}

bool OscillatorBank::Tie(const ForceKnot& knot, size_t offset, BlockMix& mix) noexcept {
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  offset = NotBeforeTheLast(offset, batch);
  RenderStrikes(offset, mix);
  const bool finite = force_.Tie(knot, lanes_, batch.re(0, lane_count_), batch.im(0, lane_count_));
  if (finite) batch.offsets[batch.count++] = offset;
  newborn_ = true;
  return finite;
}

size_t OscillatorBank::NotBeforeTheLast(size_t offset, const StrikeBatch& batch) const noexcept {
  return std::max(offset, batch.count > 0 ? batch.offsets[batch.count - 1] : rendered_to_);
}

void OscillatorBank::BeginStrikes(BlockMix& mix) noexcept {
  BeginBlock(mix);
  if (!newborn_) mix.batch().count = rendered_to_ = 0;
}

void OscillatorBank::RenderStrikes(size_t end, BlockMix& mix) noexcept {
  if (force_.driving()) return RenderDrivenStrikes(end, mix);
  const bank_kernel::StruckPart part{
      .begin = rendered_to_, .end = end, .batch = mix.batch(), .lane_count = lane_count_};
  for (const Segment& segment : segments_) {
    bank_kernel::RingStruck(lanes_, segment.range, part, mix.lanes().lanes());
  }
  mix.batch().count = 0;
  rendered_to_ = end;
}

void OscillatorBank::RenderDrivenStrikes(size_t end, BlockMix& mix) noexcept {
  StrikeBatch& batch = mix.batch();
  for (size_t i = 0; i < batch.count; ++i) {
    RenderDriven(batch.offsets[i], mix.lanes());
    bank_kernel::AddStrike(lanes_, lane_count_, batch.re(i, lane_count_), batch.im(i, lane_count_));
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
  newborn_ = true;
  RenderStrikes(block_frame_count_, mix);
  rendered_to_ = 0;
  return Advance();
}

bool OscillatorBank::RenderAddInTime(LaneMix& mix) noexcept {
  for (const Segment& segment : segments_) {
    bank_kernel::Ring(lanes_, {segment.range.first, segment.awake_count}, block_frame_count_,
                      mix.lanes());
  }
  return Advance();
}

bool OscillatorBank::Advance() noexcept {
  for (size_t part = 0; part < segments_.size(); ++part) {
    Segment& segment = segments_[part];
    const LaneRange range{segment.range.first,
                          newborn_ ? segment.range.count : segment.awake_count};
    if (range.count == 0) continue;
    const bank_kernel::Advanced advanced =
        bank_kernel::Advance(lanes_, range, newborn_, silence_squared_);
    changed_ |= newborn_ || segment.awake_count != advanced.awake_lane_count;
    segment.awake_count = advanced.awake_lane_count;
    segment.loudest_squared = advanced.loudest_squared;
    finite_ &= advanced.finite;
    if (part > 0 && newborn_) long_segments_[part - 1].struck = true;
  }
  newborn_ = begun_ = false;
  if (!finite_) Silence();
  if (std::exchange(changed_, false)) CountAwake();
  return std::exchange(finite_, true);
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
  changed_ |= segments_[kind + 1].awake_count > 0 || (segment.sounding && !segment.awake);
  segment.sounding = false;
  if (segment.struck_streak >= kBusyStreak || leaving_spectrum_) {
    MoveToTime(kind);
    return true;
  }
  MoveToSpectrum(kind);
  if (!segment.awake) return true;
  const bank_kernel::Advanced advanced =
      bank_kernel::Spread(segment.lanes, segment.mode_count, silence_squared_, mix.Slots(kind));
  changed_ |= advanced.fell_asleep;
  segment.awake = segment.sounding = advanced.awake;
  segment.loudest_squared = advanced.loudest_squared;
  return advanced.finite;
}

void OscillatorBank::MoveToSpectrum(size_t kind) noexcept {
  Segment& from = segments_[kind + 1];
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
  Segment& to = segments_[kind + 1];
  if (!from.awake) return;
  changed_ = true;
  for (size_t i = 0; i < to.range.count; ++i) {
    const size_t lane = to.range.first + i;
    lanes_.re[lane] += std::exchange(from.lanes.re[i], 0);
    lanes_.im[lane] += std::exchange(from.lanes.im[i], 0);
    lanes_.start_re[lane] = static_cast<float>(lanes_.re[lane]);
    lanes_.start_im[lane] = static_cast<float>(lanes_.im[lane]);
  }
  std::ranges::fill(from.lanes.awake, uint8_t{0});
  from.awake = false;
  to.awake_count = to.range.count;
}

void OscillatorBank::Silence() noexcept {
  changed_ = true;
  lanes_.Silence({0, lane_count_});
  force_.Silence();
  for (Segment& segment : segments_) segment.awake_count = 0;
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
  for (const Segment& segment : segments_) asleep_count -= segment.awake_count;
  return TimeWork(asleep_count);
}

double OscillatorBank::TimeWork(size_t lane_count) const noexcept {
  return work::kTimeLane * static_cast<double>(lane_count * block_frame_count_) / 128;
}

double OscillatorBank::loudest_squared() const noexcept {
  double loudest = 0;
  for (const Segment& segment : segments_) {
    if (segment.awake_count > 0) loudest = std::max(loudest, segment.loudest_squared);
  }
  for (const LongSegment& segment : long_segments_) {
    if (segment.awake) loudest = std::max(loudest, segment.loudest_squared);
  }
  return loudest;
}

/// Over at most kVertices vertices, evenly.
void OscillatorBank::MeasureBlow(const LanePlan& plan) {
  constexpr size_t kVertices = 32;
  const size_t stride = std::max<size_t>(shapes_.vertex_count() / kVertices, 1);
  double sum = 0;
  size_t count = 0;
  for (size_t vertex = 0; vertex < shapes_.vertex_count(); vertex += stride) {
    for (size_t axis = 0; axis < 3; ++axis, ++count) {
      for (const auto& planned : plan.lanes) {
        for (const PlannedLane& lane : planned) {
          const double shape = shapes_.Row(vertex, axis)[lane.column];
          if (!lane.companion) sum += std::norm(lane.start) * shape * shape;
        }
      }
    }
  }
  // A blow has one direction of the three.
  loudness_of_blow_ =
      count == 0 ? 0 : static_cast<float>(std::sqrt(sum / static_cast<double>(count)));
}

void OscillatorBank::CountAwake() noexcept {
  active_mode_count_ = 0;
  ringing_work_ = 0;
  any_awake_ = awake_in_time_ = false;
  for (size_t part = 0; part < segments_.size(); ++part) {
    const Segment& segment = segments_[part];
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

std::string_view SimdTarget() { return bank_kernel::Target(); }

}  // namespace carillon
