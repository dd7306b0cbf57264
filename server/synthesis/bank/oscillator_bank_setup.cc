// SPDX-License-Identifier: Apache-2.0
// The construction of a bank, which any thread may do.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "server/synthesis/bank/lane_plan.h"
#include "server/synthesis/bank/oscillator_bank.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;

/// The shortest time in which gains change: that of a voice's cross-fade after a jump.
constexpr double kGainPeriodS = 0.01;

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

void WritePowers(Complex log_q, size_t tile_kind, size_t lane, LaneArrays& lanes) {
  for (size_t k = 0; k < kTileNodes; ++k) {
    const Complex power = std::exp(log_q * TileNode(tile_kind, k + 1));
    const size_t index = LaneArrays::PowerIndex(lane, k);
    lanes.powers[index] = static_cast<float>(power.real());
    lanes.powers[index + kMostLanes] = static_cast<float>(power.imag());
  }
  Set(lanes.q_re, lanes.q_im, lane, std::exp(log_q));
  Set(lanes.step_re, lanes.step_im, lane, std::exp(log_q * static_cast<double>(kTileFrames[0])));
}

void WriteLane(const PlannedLane& planned, uint32_t first_column, size_t block_frame_count,
               size_t lane, LaneArrays& lanes) {
  const Complex block = std::exp(planned.log_q * static_cast<double>(block_frame_count));
  lanes.block_re[lane] = block.real();
  lanes.block_im[lane] = block.imag();
  Set(lanes.gain_re, lanes.gain_im, lane, planned.start);
  Set(lanes.lead_re, lanes.lead_im, lane, planned.log_q);
  Set(lanes.contact_re, lanes.contact_im, lane, planned.contact_s);
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

/// The planned lanes of a run, without padding.
std::span<const PlannedLane> LanesOf(const LaneRun& run, const LanePlan& plan) {
  const std::span<const PlannedLane> planned = plan.lanes[run.segment];
  return planned.subspan(run.first_in_segment,
                         std::min(run.range.count, planned.size() - run.first_in_segment));
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
      lane_count_(CountLanes(plan)),
      first_column_(FirstColumn(sounding)),
      column_count_(CountColumns(sounding)),
      force_(lane_count_, column_count_, settings.sample_rate_hz, settings.noise_seed),
      lanes_(lane_count_) {
  assert(block_frame_count_ > 0 && block_frame_count_ <= kMostBlockFrames);
  assert(first_column_ + column_count_ <= shapes_.mode_count());
  assert(lane_count_ <= StrikeBatch::kMostBankLanes);
  assert(column_count_ <= StrikeBatch::kMostBankLanes);
  for (const size_t tile_kind : kTileOrder) {
    for (size_t part = 0; part < plan.lanes.size(); ++part) {
      const LaneRange tiled = plan.Tiled(part, tile_kind);
      if (tiled.count > 0) lanes_.Add(tiled.count, tile_kind, part, tiled.first);
    }
  }
  SetSegments(plan);
  const double lowest_rad_per_s =
      sounding.modes.empty() ? 1 : sounding.modes.front().damped_rad_per_s;
  for (const LaneRun& run : lanes_.runs) {
    size_t lane = run.range.first;
    for (const PlannedLane& planned : LanesOf(run, plan)) {
      WritePowers(planned.log_q, run.tile_kind, lane, lanes_);
      WriteLane(planned, first_column_, block_frame_count_, lane, lanes_);
      force_.SetLane(lane++, planned.start, planned.log_q * settings.sample_rate_hz,
                     lowest_rad_per_s);
    }
  }
  MeasureLoudness(plan);
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
      if (!planned[i].companion) ++group_mode_counts_[first_group + i / kMostLanes];
    }
    if (part == 0) continue;
    long_segments_.push_back(
        {.lanes = MakeSpectralLanes(planned, plan.PaddedCount(part), long_blocks[part - 1]),
         .mode_count = planned.size(),
         .block_count = long_blocks[part - 1].block_count});
  }
}

/// Samples fewer than 2 * kVertices vertices, evenly spaced by index.
void OscillatorBank::MeasureLoudness(const LanePlan& plan) {
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
  // The mean is over vertices and axes, because an impulse is taken along one of the three axes.
  loudness_per_newton_second_ =
      count == 0 ? 0 : static_cast<float>(std::sqrt(sum / static_cast<double>(count)));
}

}  // namespace carillon
