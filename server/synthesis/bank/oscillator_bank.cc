// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/oscillator_bank.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <variant>

#include "server/synthesis/bank/bank_lanes.h"
#include "server/synthesis/bank/lane_plan.h"
#include "server/synthesis/ringing/sum_kernel.h"
#include "server/synthesis/schedule/work_budget.h"
#include "server/synthesis/spectrum/spectral_kernel.h"

namespace carillon {
namespace {

/// A segment that was struck in this number of consecutive long blocks stays in the time domain,
/// where each impulse brings it back to anyway; the spectrum would be extra work.
constexpr uint32_t kBusyStreak = 4;

/// The shortest time in which gains change: that of a voice's cross-fade after a jump.
constexpr double kGainPeriodS = 0.01;

/// In longer tiles each impulse needs a tile of its own. With more impulses in a block than this,
/// those tiles cost more than longer tiles save.
constexpr size_t kMostStrikesInTiles = 8;

/// The corner of the triangle that is nearest to the point.
size_t NearestCorner(const TrianglePoint& at) {
  return static_cast<size_t>(std::ranges::max_element(at.weights) - at.weights.begin());
}

/// The point at which an impulse or a force acts; null for another kind of event.
const TrianglePoint* PointOf(const MixerEvent& event) {
  if (const SurfaceImpulse* impulse = event.impulse()) return &impulse->at;
  const auto* force = std::get_if<SurfaceForce>(&event.action);
  return force != nullptr ? &force->at : nullptr;
}

double Norm(const std::array<float, 3>& vector) {
  return std::hypot(vector[0], vector[1], vector[2]);
}

strike_kernel::Onset OnsetOf(float lead_frames, Pulse pulse) {
  return {.lead_frames = lead_frames,
          .gaussian_tau_s = pulse.gaussian() ? pulse.duration_s() / 4 : 0,
          .cosine_duration_s = pulse.gaussian() ? 0 : pulse.duration_s()};
}

}  // namespace

OscillatorBank::OscillatorBank(const SoundingModes& sounding, const ShapeTable& shapes,
                               const OscillatorBankSettings& settings)
    : OscillatorBank(PlanLanes(sounding, shapes,
                               {.sample_rate_hz = settings.sample_rate_hz,
                                .block_frame_count = settings.block_frame_count,
                                .gain = settings.gain,
                                .directed = settings.directivity.has_value()}),
                     sounding, shapes, settings) {}

OscillatorBank::OscillatorBank(const LanePlan& plan, const SoundingModes& sounding,
                               ShapeTable shapes, const OscillatorBankSettings& settings)
    : shapes_(std::move(shapes)),
      block_frame_count_(settings.block_frame_count),
      silence_squared_(settings.silence * settings.silence),
      mode_count_(sounding.modes.size()),
      lane_count_(plan.PaddedCount()),
      multiplets_(sounding, shapes_),
      loudness_per_newton_second_(MeasureLoudness(plan, multiplets_, shapes_)),
      force_(lane_count_, multiplets_.column_count(), settings.sample_rate_hz, settings.noise_seed),
      lanes_(MakeLaneArrays(plan, multiplets_, block_frame_count_)) {
  assert(block_frame_count_ > 0 && block_frame_count_ <= kMostBlockFrames);
  assert(multiplets_.first_column() + multiplets_.projected_count() <= shapes_.mode_count());
  assert(lane_count_ <= StrikeBatch::kMostBankLanes);
  assert(multiplets_.column_count() <= StrikeBatch::kMostBankLanes);
  SetSegments(plan);
  const double lowest_rad_per_s =
      sounding.modes.empty() ? 1 : sounding.modes.front().damped_rad_per_s;
  for (const LaneRun& run : lanes_.runs) {
    size_t lane = run.range.first;
    for (const PlannedLane& planned : LanesOf(run, plan)) {
      force_.SetLane(lane++, planned.start, planned.log_q * settings.sample_rate_hz,
                     lowest_rad_per_s);
    }
  }
  if (settings.directivity) SetDirectivity(sounding, plan, settings);
  if (!settings.moved) return;
  assert(settings.moved->vertices.size() == shapes_.vertex_count());
  moved_ = std::make_unique<AccelerationNoise>(*settings.moved, settings.sample_rate_hz,
                                               settings.gain / kFullScalePa);
}

void OscillatorBank::SetDirectivity(const SoundingModes& sounding, const LanePlan& plan,
                                    const OscillatorBankSettings& settings) {
  std::vector<DirectedGains::Mode> modes;
  for (const SoundingMode& mode : sounding.modes) {
    modes.push_back({.column = mode.column,
                     .wavenumber = 2 * std::numbers::pi * mode.natural_frequency_hz /
                                   settings.directivity->sound_speed_m_per_s});
  }
  for (const LaneRun& run : lanes_.runs) {
    size_t lane = run.range.first;
    for (const PlannedLane& planned : LanesOf(run, plan)) {
      const auto mode =
          std::ranges::lower_bound(modes, planned.column, {}, &DirectedGains::Mode::column);
      (planned.companion ? mode->companion_lane : mode->lane) = lane++;
    }
  }
  const auto period = static_cast<size_t>(kGainPeriodS * settings.sample_rate_hz);
  gains_ =
      std::make_unique<DirectedGains>(*settings.directivity, std::move(modes),
                                      DirectedGains::Size{lane_count_, period, block_frame_count_});
}

void OscillatorBank::SetSegments(const LanePlan& plan) {
  const auto long_blocks = MakeLongBlocks(block_frame_count_);
  for (size_t part = 0; part < plan.lanes.size(); ++part) {
    const std::vector<PlannedLane>& planned = plan.lanes[part];
    segments_[part].lane_count = plan.PaddedCount(part);
    const size_t first_group = group_mode_counts_.size();
    group_mode_counts_.resize(first_group + plan.PaddedCount(part) / kMostLanes);
    for (size_t i = 0; i < planned.size(); ++i) {
      group_mode_counts_[first_group + i / kMostLanes] += planned[i].mode_count;
    }
    if (part == 0) continue;
    long_segments_.push_back(
        {.lanes = MakeSpectralLanes(planned, plan.PaddedCount(part), long_blocks[part - 1]),
         .mode_count = planned.size(),
         .block_count = long_blocks[part - 1].block_count});
  }
}

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
    float* const frames = lanes.frames();
    for (size_t n = 0; n < block_frame_count_; ++n) frames[n] += sound[n];
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
    awake_changed_ |= segment.awake;
    segment.GiveToTime(kind + 1, segments_[kind + 1], lanes_);
    return true;
  }
  segment.TakeFromTime(kind + 1, segments_[kind + 1], lanes_);
  if (!segment.awake) return true;
  const spectral_kernel::Spreading advanced =
      spectral_kernel::Spread(segment.lanes, segment.mode_count, silence_squared_, mix.Slots(kind));
  awake_changed_ |= advanced.fell_asleep;
  segment.awake = segment.sounding = advanced.awake;
  segment.loudest_squared = advanced.loudest_squared;
  return advanced.finite;
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
  for (LongSegment& segment : long_segments_) segment.Silence();
}

bool OscillatorBank::BoundLoudness() noexcept {
  if (!std::exchange(loudness_changed_, false)) return false;
  const double loudest = loudest_squared();
  if (!(loudest > kMostAmplitude * kMostAmplitude)) return false;
  const double factor = kMostAmplitude / std::sqrt(loudest);
  for (size_t i = 0; i < lane_count_; ++i) {
    lanes_.re[i] *= factor;
    lanes_.im[i] *= factor;
  }
  for (RingingSegment& segment : segments_) segment.loudest_squared *= factor * factor;
  for (LongSegment& segment : long_segments_) segment.Scale(factor);
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

std::optional<strike_kernel::Projection> OscillatorBank::Project(
    const TrianglePoint& at, const std::array<float, 3>& vector) const noexcept {
  strike_kernel::Projection projection{.column_count = multiplets_.projected_count()};
  for (size_t i = 0; i < 3; ++i) {
    if (at.vertices[i] >= shapes_.vertex_count()) return std::nullopt;
    AddVertex(at.vertices[i], at.weights[i], vector, projection);
  }
  return projection;
}

void OscillatorBank::AddVertex(size_t vertex, float weight, const std::array<float, 3>& vector,
                               strike_kernel::Projection& projection) const noexcept {
  for (size_t axis = 0; axis < 3; ++axis) {
    projection.rows[projection.row_count] = shapes_.Row(vertex, axis) + multiplets_.first_column();
    projection.factors[projection.row_count++] = weight * vector[axis];
  }
}

StrikeBatch::RowsAhead OscillatorBank::RowsOf(std::span<const DueEvent> events) const noexcept {
  StrikeBatch::RowsAhead ahead{.value_count = 3 * shapes_.stride()};
  for (const DueEvent& due : events) {
    const TrianglePoint* at = PointOf(*due.event);
    if (at == nullptr) continue;
    const size_t nearest = NearestCorner(*at);
    for (size_t i = 0; i < 3; ++i) {
      const size_t vertex = at->vertices[i];
      if (vertex >= shapes_.vertex_count() || (due.merged && i != nearest)) continue;
      ahead.rows[ahead.count++] = shapes_.Row(vertex, 0);
      if (ahead.count == ahead.rows.size()) return ahead;
    }
  }
  return ahead;
}

bool OscillatorBank::StrikeMerged(std::span<const DueEvent> events, BlockMix& mix) noexcept {
  if (mode_count_ == 0) return true;
  float* modal_impulses = mix.batch().modal_impulses();
  strike_kernel::Projection projection{.column_count = multiplets_.projected_count()};
  double weight_sum = 0, time_sum = 0, variance_sum = 0, most_weight = 0;
  Pulse shape;
  OctaveGains gains;
  for (const DueEvent& due : events) {
    const SurfaceImpulse* impulse = due.event->impulse();
    assert(impulse != nullptr);
    const uint32_t nearest = impulse->at.vertices[NearestCorner(impulse->at)];
    if (nearest >= shapes_.vertex_count()) continue;
    const double weight = Norm(impulse->impulse_newton_seconds);
    weight_sum += weight;
    time_sum += weight * (due.offset - double{due.event->LeadFrames()});
    variance_sum += weight * impulse->pulse.variance_s2();
    if (weight > most_weight) {
      shape = impulse->pulse;
      gains = impulse->gains;
    }
    most_weight = std::max(most_weight, weight);
    AddVertex(nearest, 1, impulse->impulse_newton_seconds, projection);
    if (projection.row_count < projection.rows.size()) continue;
    strike_kernel::Project(projection, modal_impulses);
    projection.row_count = 0;
    projection.add = true;
  }
  if (!(weight_sum > 0) || !std::isfinite(weight_sum)) return false;
  if (projection.row_count > 0) strike_kernel::Project(projection, modal_impulses);
  const double time = time_sum / weight_sum;
  const double offset = std::max(std::ceil(time), 0.0);
  const Pulse pulse = Pulse::OfVariance(static_cast<float>(variance_sum / weight_sum), shape);
  const auto lead_frames = static_cast<float>(offset - time);
  return StrikeModes(static_cast<size_t>(offset), OnsetOf(lead_frames, pulse), gains, mix);
}

bool OscillatorBank::Strike(const SurfaceImpulse& impulse, size_t offset, float lead_frames,
                            BlockMix& mix) noexcept {
  if (mode_count_ == 0) return true;
  const std::optional<strike_kernel::Projection> projection =
      Project(impulse.at, impulse.impulse_newton_seconds);
  if (!projection) return false;
  strike_kernel::Project(*projection, mix.batch().modal_impulses());
  return StrikeModes(offset, OnsetOf(lead_frames, impulse.pulse), impulse.gains, mix);
}

double OscillatorBank::ContactLeadFrames(Pulse pulse) const noexcept {
  return moved_ == nullptr ? 0 : moved_->PulseFrames(pulse) / 2;
}

bool OscillatorBank::BeginContact(const SurfaceImpulse& impulse, size_t offset,
                                  float lead_frames) noexcept {
  const auto known = [this](uint32_t vertex) { return vertex < shapes_.vertex_count(); };
  if (moved_ == nullptr || !std::ranges::all_of(impulse.at.vertices, known)) return false;
  moved_->Begin(impulse, offset, lead_frames, gains_ == nullptr ? nullptr : &gains_->bearing());
  return true;
}

/// Applies the projected impulses in the batch. The caller leaves onset.frames_into_tiles at zero.
bool OscillatorBank::StrikeModes(size_t offset, strike_kernel::Onset onset,
                                 const OctaveGains& gains, BlockMix& mix) noexcept {
  std::array<float, OctaveGains::kCount> factors{};
  if (!gains.none()) {
    for (size_t octave = 0; octave < factors.size(); ++octave) {
      factors[octave] = gains.Factor(octave);
    }
    onset.octave_factors = factors.data();
  }
  multiplets_.Combine(mix.batch().modal_impulses());
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  const size_t asked = std::exchange(offset, NotBeforeTheLast(offset, batch));
  onset.lead_frames += static_cast<float>(offset - asked);
  if (batch.count == StrikeBatch::Capacity(lane_count_)) RenderStrikes(offset, mix);
  if (!force_.driving() && !block_.by_frames) {
    onset.frames_into_tiles = offset - block_.rendered_to;
  }
  const bool finite =
      strike_kernel::Excite(lanes_, lane_count_, batch.modal_impulses(), onset, batch.ahead,
                            batch.re(batch.count, lane_count_), batch.im(batch.count, lane_count_));
  if (finite) NoteOnset(offset, batch);
  if (modes_silent()) block_.phase = Phase::kWaiting;  // silent modes are not rendered
  return finite;
}

bool OscillatorBank::AddForce(const SurfaceForce& force) noexcept {
  if (mode_count_ == 0) return true;
  const std::optional<strike_kernel::Projection> projection =
      Project(force.at, force.force_newtons);
  if (projection) force_.AddForce(*projection);
  return projection.has_value();
}

bool OscillatorBank::ApplyKnot(const ForceKnot& knot, size_t offset, BlockMix& mix) noexcept {
  if (mode_count_ == 0) return true;
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  const bool silent_before = modes_silent();
  offset = NotBeforeTheLast(offset, batch);
  RenderStrikes(offset, mix);
  multiplets_.Combine(force_.next());
  const bool finite =
      force_.ApplyKnot(knot, lanes_, batch.re(0, lane_count_), batch.im(0, lane_count_));
  if (finite) {
    NoteOnset(offset, batch);
  } else if (silent_before) {
    block_.phase = Phase::kWaiting;
  }
  return finite;
}

void OscillatorBank::NoteOnset(size_t offset, StrikeBatch& batch) noexcept {
  batch.offsets[batch.count++] = offset;
  block_.phase = std::max(block_.phase, Phase::kStruck);
}

size_t OscillatorBank::NotBeforeTheLast(size_t offset, const StrikeBatch& batch) const noexcept {
  return std::max(offset, batch.count > 0 ? batch.offsets[batch.count - 1] : block_.rendered_to);
}

void OscillatorBank::BeginStrikes(BlockMix& mix) noexcept {
  BeginBlock(mix);
  if (struck()) return;
  mix.batch().count = block_.rendered_to = 0;
  block_.by_frames = mix.batch().due_count > kMostStrikesInTiles;
}

/// A part that covers the whole block shares the mix's nodes with all banks; another part has nodes
/// of its own.
ring_kernel::StruckPart OscillatorBank::BeginPart(size_t end, StrikeBatch& batch,
                                                  LaneMix& lanes) const noexcept {
  batch.part_nodes.Clear();
  const bool whole = block_.rendered_to == 0 && end == block_frame_count_;
  NodeMix& nodes = whole ? lanes.nodes() : batch.part_nodes;
  const ring_kernel::TileSums sums = block_.by_frames
                                         ? ring_kernel::TileSums{lanes.lanes()}
                                         : Sums(nodes, end - block_.rendered_to, lanes);
  for (size_t kind = 1; kind < kTileKinds; ++kind) {
    if (sums[kind] == nullptr) continue;
    for (size_t i = 0; i < batch.count; ++i) {
      std::fill_n(batch.nodes(i, kind), kNodeFloats, 0.0F);
    }
  }
  return {.sums = sums,
          .begin = block_.rendered_to,
          .end = end,
          .started = block_.phase == Phase::kInParts,
          .by_frames = block_.by_frames,
          .batch = batch,
          .lane_count = lane_count_};
}

ring_kernel::TileSums OscillatorBank::Sums(NodeMix& nodes, size_t frame_count,
                                           LaneMix& mix) const noexcept {
  ring_kernel::TileSums sums{mix.lanes()};
  for (size_t kind = 1; kind < kTileKinds; ++kind) {
    if (lanes_.by_tile[kind].count > 0) sums[kind] = nodes.Use(kind, frame_count);
  }
  return sums;
}

void OscillatorBank::FinishPart(const ring_kernel::StruckPart& part,
                                LaneMix& lanes) const noexcept {
  if (!part.HasLongTiles()) return;
  float* frames = lanes.frames();
  part.batch.part_nodes.AddTo(part.begin, part.end, frames);
  for (size_t kind = 1; kind < kTileKinds; ++kind) {
    if (part.sums[kind] == nullptr) continue;
    sum_kernel::AddStruckTiles({.kind = kind, .begin = part.begin, .end = part.end},
                               std::span(part.batch.offsets).first(part.batch.count),
                               part.batch.nodes(0, kind), StrikeBatch::kNodeStride, frames);
  }
}

/// Renders the block up to frame `end` with the onsets in the batch, and empties the batch.
void OscillatorBank::RenderStrikes(size_t end, BlockMix& mix) noexcept {
  if (block_.phase != Phase::kInParts) ring_kernel::Start(lanes_, lane_count_);
  block_.phase = Phase::kInParts;
  if (force_.driving()) return RenderDrivenStrikes(end, mix);
  HearStruck(end, mix);
  const ring_kernel::StruckPart part = BeginPart(end, mix.batch(), Advanced(mix));
  ring_kernel::RingStruck(lanes_, part);
  FinishPart(part, Advanced(mix));
  mix.batch().count = 0;
  block_.rendered_to = end;
}

void OscillatorBank::HearStruck(size_t end, BlockMix& mix) noexcept {
  if (gains_ == nullptr) return;
  mix.unheard().Clear(block_frame_count_);
  if (end == block_.rendered_to) return;
  const auto hear = [&](LaneMix& lanes, const ring_kernel::Gains& gains) {
    ring_kernel::StruckPart part = BeginPart(end, mix.batch(), lanes);
    part.gains = gains;
    ring_kernel::HearStruck(lanes_, part);
    FinishPart(part, lanes);
  };
  hear(mix.lanes(), gains_->at_end());
  if (gains_move()) hear(mix.fading(block_frame_count_), gains_->at_begin());
}

void OscillatorBank::RenderDrivenStrikes(size_t end, BlockMix& mix) noexcept {
  StrikeBatch& batch = mix.batch();
  for (size_t i = 0; i < batch.count; ++i) {
    RenderDriven(batch.offsets[i], mix);
    ring_kernel::AddStrike(lanes_, lane_count_, batch.re(i, lane_count_), batch.im(i, lane_count_));
  }
  batch.count = 0;
  RenderDriven(end, mix);
}

void OscillatorBank::RenderDriven(size_t end, BlockMix& mix) noexcept {
  const size_t first = block_.rendered_to * kMostLanes;
  force_kernel::DrivenOutput output{.mix = mix.lanes().lanes() + first};
  if (gains_ != nullptr) output.gains = gains_->at_end();
  if (gains_move()) {
    output.second_mix = mix.fading(block_frame_count_).lanes() + first;
    output.second_gains = gains_->at_begin();
  }
  force_.Render(end - block_.rendered_to, lanes_, output);
  block_.rendered_to = end;
}

bool OscillatorBank::FinishStruck(BlockMix& mix) noexcept {
  if (force_.driving()) RenderStrikes(block_frame_count_, mix);
  HearStruck(block_frame_count_, mix);
  const ring_kernel::StruckPart part = BeginPart(block_frame_count_, mix.batch(), Advanced(mix));
  block_.finite &= ring_kernel::FinishStruck(lanes_, segments_, part, silence_squared_);
  FinishPart(part, Advanced(mix));
  for (LongSegment& segment : long_segments_) segment.struck = true;
  return EndBlock();
}

std::string_view SimdTarget() { return ring_kernel::Target(); }

}  // namespace carillon
