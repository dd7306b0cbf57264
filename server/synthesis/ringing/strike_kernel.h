// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/strike_batch.h"

/// From a strike on the surface to what it adds to the states, compiled for every SIMD target and
/// dispatched at run time. Nothing here allocates, locks or throws.
namespace carillon::strike_kernel {

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
  /// To the strike's frame from that where longer tiles (tile.h) begin one after the other; 0:
  /// states are wanted at the strike's frame.
  size_t frames_into_tiles = 0;
};

/// What modal impulses add to the states at the strike's frame, of lanes in longer tiles at the
/// begin of the tile that it falls into; into added_re and added_im. False: not finite.
bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) noexcept;

}  // namespace carillon::strike_kernel
