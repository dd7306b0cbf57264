// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/strike_batch.h"

/// Computes what an impulse on the surface adds to the states, compiled for every SIMD target and
/// dispatched at run time. Nothing here allocates, locks or throws.
namespace carillon::strike_kernel {

/// An impulse on the surface as weighted rows of the shape table.
struct Projection {
  /// For each vertex and axis: the row of the shape table, from the first projected column on, and
  /// weight times impulse.
  std::array<const int16_t*, 9> rows{};
  std::array<float, 9> factors{};
  size_t row_count = 0;
  size_t column_count = 0;
  bool add = false;  ///< add to the present modal impulses instead of overwriting them
};

/// modal_impulses[c] = sum over rows of factor * row[c], which is g_m in units of the shape table's
/// scales; writes up to the end of a vector.
void Project(const Projection& projection, float* modal_impulses) noexcept;

/// The onset of modal impulses in time.
struct Onset {
  float lead_frames = 0;        ///< from the impulse to its first audible sample
  float gaussian_tau_s = 0;     ///< standard deviation of a Gaussian pulse; zero for another pulse
  float cosine_duration_s = 0;  ///< duration of a raised cosine; zero for another pulse
  /// The factor of each octave (OctaveGains), or null if all are one.
  const float* octave_factors = nullptr;
  /// Number of frames from the start of the part's first tile (tile.h) to the onset. If it is zero,
  /// the states of lanes in longer tiles, too, are computed at the onset's frame.
  size_t frames_into_tiles = 0;
};

/// Writes the changes of the states by modal impulses into added_re and added_im. The changes are
/// those at the onset's frame or, for lanes in longer tiles, at the start of the onset's tile.
/// Returns false if a change is not finite.
bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) noexcept;

}  // namespace carillon::strike_kernel
