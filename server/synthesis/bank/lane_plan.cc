// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/lane_plan.h"

#include <algorithm>
#include <optional>

#include "server/synthesis/bank/level.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;

/// Returns s = sigma + i omega. Where sigma^2 > omega^2, the factor exp(s^2 tau^2/2) of a Gaussian
/// would explode, so the function returns i |s| instead.
Complex ContactS(const SoundingMode& mode) {
  const Complex s(mode.decay_rate_per_s, mode.damped_rad_per_s);
  return -s.real() < s.imag() ? s : Complex(0, std::abs(s));
}

PlannedLane PlanLane(const SoundingMode& mode, const LanePlanSettings& settings, double gain,
                     bool companion) {
  const double sigma = mode.decay_rate_per_s - (companion ? mode.damped_rad_per_s : 0);
  return {.column = mode.column,
          .multiplet = mode.multiplet,
          .mode_count = companion ? 0U : 1U,
          .log_q = Complex(sigma, mode.damped_rad_per_s) / settings.sample_rate_hz,
          .start = std::polar((companion ? -gain : gain) * mode.coupling / mode.damped_rad_per_s,
                              mode.output_phase_rad) *
                   Complex(0, -1),
          .contact_s = ContactS(mode),
          .spread = {},
          .companion = companion};
}

/// Adds a lane to its part. A companion stays in the time domain, because it decays within two
/// periods.
void Place(PlannedLane lane, size_t block_frame_count, LanePlan& plan) {
  const std::optional<size_t> kind =
      lane.companion ? std::nullopt : ChooseLongBlock(lane.log_q, block_frame_count);
  if (kind) lane.spread = MakeSpreadMode(lane.log_q, MakeLongBlocks(block_frame_count)[*kind]);
  plan.lanes[kind ? *kind + 1 : 0].push_back(lane);
}

/// Moves the `count` fastest decaying lanes of a part to the next shorter kind of long block.
void MoveToShorter(size_t part, size_t count, size_t block_frame_count, LanePlan& plan) {
  const LongBlock shorter = MakeLongBlocks(block_frame_count)[part - 2];
  std::vector<PlannedLane>& from = plan.lanes[part];
  const auto first = from.end() - static_cast<ptrdiff_t>(count);
  std::ranges::nth_element(from, first, std::ranges::greater(),
                           [](const PlannedLane& lane) { return lane.log_q.real(); });
  for (auto lane = first; lane != from.end(); ++lane) {
    lane->spread = MakeSpreadMode(lane->log_q, shorter);
    plan.lanes[part - 1].push_back(*lane);
  }
  from.erase(first, from.end());
}

/// Moves the few lanes that do not fill a vector to shorter long blocks, where they cost little
/// more. In the time domain an incomplete vector costs as much as a full one.
void FillVectors(size_t block_frame_count, LanePlan& plan) {
  constexpr size_t kLeastPerMoved = 4;
  for (size_t part = kLongBlockKinds; part > 1; --part) {
    const size_t size = plan.lanes[part].size(), few = size % kMostLanes;
    if (few * kLeastPerMoved <= size) MoveToShorter(part, few, block_frame_count, plan);
  }
}

/// The end of the leading whole vectors of a part whose lanes all allow tiles of this kind.
size_t EndOfTiled(const std::vector<PlannedLane>& lanes, size_t tile_kind) {
  const auto other = std::ranges::find_if(
      lanes, [=](const PlannedLane& lane) { return ChooseTile(lane.log_q) < tile_kind; });
  const auto count = static_cast<size_t>(other - lanes.begin());
  const bool all = other == lanes.end();
  return (all ? count + kMostLanes - 1 : count) / kMostLanes * kMostLanes;
}

}  // namespace

LaneRange LanePlan::Tiled(size_t part, size_t tile_kind) const {
  const auto end = [&](size_t kind) {
    if (kind == kTileKinds || (part == 0 && kind > 0)) return size_t{0};
    return EndOfTiled(lanes[part], kind);
  };
  const size_t first = end(tile_kind + 1);
  return {first, end(tile_kind) - first};
}

LanePlan PlanLanes(const SoundingModes& sounding, const ShapeTable& shapes,
                   const LanePlanSettings& settings) {
  LanePlan plan;
  for (auto next = sounding.modes.begin(); next != sounding.modes.end();) {
    const SoundingMode& mode = *next++;
    const double gain = sounding.shape_scale * kSamplesPerVolumeVelocity * settings.gain;
    if (mode.multiplet != 0) {
      PlannedLane lane = PlanLane(mode, settings, gain, false);
      for (; next != sounding.modes.end() && next->multiplet == mode.multiplet; ++next) {
        ++lane.mode_count;
      }
      Place(lane, settings.block_frame_count, plan);
      continue;
    }
    const double scaled = gain * double{shapes.scale(mode.column)};
    Place(PlanLane(mode, settings, scaled, false), settings.block_frame_count, plan);
    if (mode.output_phase_rad == 0 && !settings.directed) continue;
    Place(PlanLane(mode, settings, scaled, true), settings.block_frame_count, plan);
  }
  FillVectors(settings.block_frame_count, plan);
  std::ranges::stable_sort(plan.lanes[0], std::ranges::greater(),
                           [](const PlannedLane& lane) { return lane.log_q.real(); });
  for (size_t part = 1; part < plan.lanes.size(); ++part) {
    std::ranges::stable_sort(plan.lanes[part], {},
                             [](const PlannedLane& lane) { return lane.spread.slot; });
  }
  return plan;
}

}  // namespace carillon
