// SPDX-License-Identifier: Apache-2.0
// Impulses and knots of a bank within a block.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <variant>

#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/ringing/sum_kernel.h"

namespace carillon {
namespace {

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

std::optional<strike_kernel::Projection> OscillatorBank::Project(
    const TrianglePoint& at, const std::array<float, 3>& vector) const noexcept {
  strike_kernel::Projection projection{.column_count = column_count_};
  for (size_t i = 0; i < 3; ++i) {
    if (at.vertices[i] >= shapes_.vertex_count()) return std::nullopt;
    AddVertex(at.vertices[i], at.weights[i], vector, projection);
  }
  return projection;
}

void OscillatorBank::AddVertex(size_t vertex, float weight, const std::array<float, 3>& vector,
                               strike_kernel::Projection& projection) const noexcept {
  for (size_t axis = 0; axis < 3; ++axis) {
    projection.rows[projection.row_count] = shapes_.Row(vertex, axis) + first_column_;
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
  strike_kernel::Projection projection{.column_count = column_count_};
  double weight_sum = 0, time_sum = 0, variance_sum = 0, most_weight = 0;
  Pulse shape;
  for (const DueEvent& due : events) {
    const SurfaceImpulse* impulse = due.event->impulse();
    assert(impulse != nullptr);
    const uint32_t nearest = impulse->at.vertices[NearestCorner(impulse->at)];
    if (nearest >= shapes_.vertex_count()) continue;
    const double weight = Norm(impulse->impulse_newton_seconds);
    weight_sum += weight;
    time_sum += weight * (due.offset - double{due.event->LeadFrames()});
    variance_sum += weight * impulse->pulse.variance_s2();
    if (weight > most_weight) shape = impulse->pulse;
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
  return StrikeModes({modal_impulses, column_count_}, static_cast<size_t>(offset),
                     OnsetOf(lead_frames, pulse), mix);
}

bool OscillatorBank::Strike(const SurfaceImpulse& impulse, size_t offset, float lead_frames,
                            BlockMix& mix) noexcept {
  if (mode_count_ == 0) return true;
  const std::optional<strike_kernel::Projection> projection =
      Project(impulse.at, impulse.impulse_newton_seconds);
  if (!projection) return false;
  float* modal_impulses = mix.batch().modal_impulses();
  strike_kernel::Project(*projection, modal_impulses);
  return StrikeModes({modal_impulses, column_count_}, offset, OnsetOf(lead_frames, impulse.pulse),
                     mix);
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

bool OscillatorBank::StrikeModes(std::span<const float> modal_impulses, size_t offset,
                                 strike_kernel::Onset onset, BlockMix& mix) noexcept {
  assert(modal_impulses.size() == column_count_);
  BeginStrikes(mix);
  StrikeBatch& batch = mix.batch();
  const size_t asked = std::exchange(offset, NotBeforeTheLast(offset, batch));
  onset.lead_frames += static_cast<float>(offset - asked);
  if (batch.count == StrikeBatch::Capacity(lane_count_)) RenderStrikes(offset, mix);
  if (!force_.driving() && !block_.by_frames) {
    onset.frames_into_tiles = offset - block_.rendered_to;
  }
  const bool finite =
      strike_kernel::Excite(lanes_, lane_count_, modal_impulses.data(), onset, batch.ahead,
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

}  // namespace carillon
