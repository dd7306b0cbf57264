// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/synthesis/bank/lane_plan.h"
#include "server/synthesis/bank/multiplets.h"
#include "server/synthesis/bank/shape_table.h"
#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/spectrum/long_block.h"
#include "server/synthesis/spectrum/spectral_lanes.h"

namespace carillon {

/// Returns the planned lanes of a run, without padding.
std::span<const PlannedLane> LanesOf(const LaneRun& run, const LanePlan& plan);

/// Returns the silent lanes of a plan in the time domain.
LaneArrays MakeLaneArrays(const LanePlan& plan, const Multiplets& multiplets,
                          size_t block_frame_count);

/// Returns the silent lanes of a part of a plan, `planned`, that can ring in long blocks.
SpectralLanes MakeSpectralLanes(const std::vector<PlannedLane>& planned, size_t padded_count,
                                const LongBlock& block);

/// Returns the approximate loudness of an impulse of 1 N s: see
/// OscillatorBank::loudness_per_newton_second.
float MeasureLoudness(const LanePlan& plan, const Multiplets& multiplets, const ShapeTable& shapes);

}  // namespace carillon
