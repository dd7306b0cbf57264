// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/bank_lanes.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "server/base/octave_gains.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;

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

void WriteLane(const PlannedLane& planned, size_t block_frame_count, size_t lane,
               LaneArrays& lanes) {
  const Complex block = std::exp(planned.log_q * static_cast<double>(block_frame_count));
  lanes.block_re[lane] = block.real();
  lanes.block_im[lane] = block.imag();
  Set(lanes.gain_re, lanes.gain_im, lane, planned.start);
  Set(lanes.lead_re, lanes.lead_im, lane, planned.log_q);
  Set(lanes.contact_re, lanes.contact_im, lane, planned.contact_s);
}

}  // namespace

std::span<const PlannedLane> LanesOf(const LaneRun& run, const LanePlan& plan) {
  const std::span<const PlannedLane> planned = plan.lanes[run.segment];
  return planned.subspan(run.first_in_segment,
                         std::min(run.range.count, planned.size() - run.first_in_segment));
}

LaneArrays MakeLaneArrays(const LanePlan& plan, const Multiplets& multiplets,
                          size_t block_frame_count) {
  LaneArrays lanes(plan.PaddedCount());
  for (const size_t tile_kind : kTileOrder) {
    for (size_t part = 0; part < plan.lanes.size(); ++part) {
      const LaneRange tiled = plan.Tiled(part, tile_kind);
      if (tiled.count > 0) lanes.Add(tiled.count, tile_kind, part, tiled.first);
    }
  }
  for (const LaneRun& run : lanes.runs) {
    size_t lane = run.range.first;
    for (const PlannedLane& planned : LanesOf(run, plan)) {
      WritePowers(planned.log_q, run.tile_kind, lane, lanes);
      lanes.column[lane] = multiplets.ColumnOf(planned);
      lanes.octave[lane] = static_cast<uint32_t>(
          OctaveGains::OctaveOf(planned.contact_s.imag() / (2 * std::numbers::pi)));
      WriteLane(planned, block_frame_count, lane++, lanes);
    }
  }
  return lanes;
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

/// Samples fewer than 2 * kVertices vertices, evenly spaced by index.
float MeasureLoudness(const LanePlan& plan, const Multiplets& multiplets,
                      const ShapeTable& shapes) {
  constexpr size_t kVertices = 32;
  const size_t stride = std::max<size_t>(shapes.vertex_count() / kVertices, 1);
  std::vector<float> modal(multiplets.column_count());
  double sum = 0;
  size_t count = 0;
  for (size_t vertex = 0; vertex < shapes.vertex_count(); vertex += stride) {
    for (size_t axis = 0; axis < 3; ++axis, ++count) {
      const int16_t* const row = shapes.Row(vertex, axis) + multiplets.first_column();
      std::copy_n(row, multiplets.projected_count(), modal.begin());
      multiplets.Combine(modal.data());
      for (const auto& planned : plan.lanes) {
        for (const PlannedLane& lane : planned) {
          const double shape = modal[multiplets.ColumnOf(lane)];
          if (!lane.companion) sum += std::norm(lane.start) * shape * shape;
        }
      }
    }
  }
  // The mean is over vertices and axes, because an impulse is taken along one of the three axes.
  return count == 0 ? 0 : static_cast<float>(std::sqrt(sum / static_cast<double>(count)));
}

}  // namespace carillon
