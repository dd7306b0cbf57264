// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "server/synthesis/lane_arrays.h"
#include "server/synthesis/spectral_lanes.h"
#include "server/synthesis/strike_batch.h"

namespace carillon {

/// The inner loops of an oscillator bank, compiled for every SIMD target and dispatched at run
/// time. None allocates, locks or throws.
namespace bank_kernel {

/// Adds the samples [0, frame_count) of `range` to `mix` (frame n at mix[n * kMostLanes]), from the
/// state at the start of the block, which stays.
void Ring(const LaneArrays& lanes, LaneRange range, size_t frame_count, float* mix) noexcept;

/// A part of a block, with the strikes that fall into it.
struct StruckPart {
  size_t begin = 0;  ///< frames
  size_t end = 0;
  StrikeBatch& batch;
  size_t lane_count = 0;  ///< of the whole bank
};

/// The same for [part.begin, part.end), struck at the batch's offsets; advances start and newborn
/// state to part.end.
void RingStruck(LaneArrays& lanes, LaneRange range, const StruckPart& part, float* mix) noexcept;

/// Adds to the start and newborn states of the first `lane_count` lanes.
void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept;

/// What Advance and Spread found.
struct Advanced {
  size_t awake_lane_count = 0;  ///< Advance: of the range; all lanes beyond are silent
  bool awake = false;           ///< any lane is
  bool fell_asleep = false;     ///< Spread: some lanes did
  double loudest_squared = 0;   ///< largest squared amplitude
  bool finite = true;
};

/// Advances `range` by a block; with `newborn`, adds the newborn state, which it clears. Groups of
/// kMostLanes lanes whose squared amplitudes are all below `silence_squared` are silenced.
Advanced Advance(LaneArrays& lanes, LaneRange range, bool newborn, double silence_squared) noexcept;

/// Adds the first `mode_count` lanes to the slots of a spectrum and advances them by a long block.
/// Silence as for Advance, before anything is added.
Advanced Spread(SpectralLanes& lanes, size_t mode_count, double silence_squared,
                float* slots) noexcept;

/// A strike on the surface as the kernel needs it.
struct Projection {
  /// For each vertex and axis: the row of the shape table from the first column projected, and
  /// weight times impulse.
  std::array<const int16_t*, 9> rows{};
  std::array<float, 9> factors{};
  size_t row_count = 0;
  size_t column_count = 0;
  bool add = false;  ///< to what the modal impulses are already
};

/// modal_impulses[c] = sum over rows of factor * row[c]: g_m in units of the shape table's scales,
/// up to the end of a vector.
void Project(const Projection& projection, float* modal_impulses) noexcept;

/// How modal impulses reach the states.
struct Onset {
  float lead_frames = 0;  ///< from the strike to its first sample
  float tau_s = 0;        ///< of the Gaussian contact
};

/// What modal impulses add to the states, into added_re and added_im. False: not finite.
bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) noexcept;

/// Name of the target dispatched to.
std::string_view Target();

}  // namespace bank_kernel
}  // namespace carillon
