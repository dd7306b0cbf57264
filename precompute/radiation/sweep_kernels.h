// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

namespace carillon::precompute {

/// Number of targets (the vertices at which a kernel sums the fields of all sources) that a kernel
/// processes at once. Arrays over targets are padded to multiples of this number.
inline constexpr int64_t kSweepGrain = 32;
/// Number of sums for each target and side: the real and imaginary parts of the scalar and of the
/// three components of the curls' field.
inline constexpr int kSweepSums = 8;
/// Number of floats of each source before those of its sides: the position and the area vector.
inline constexpr int kSourceHead = 6;
/// Number of floats of each source and side: p and the three components of its curl, which are
/// complex.
inline constexpr int kSourceSide = 8;

/// Vertices as targets. Each array is padded to a multiple of kSweepGrain. Lengths are multiplied
/// by k / pi, so that the phase advances by half a turn in a unit of distance.
struct SweepTargets {
  std::vector<float> x, y, z;
  std::vector<float> nx, ny, nz;  ///< normals, scaled as the operator needs them
  int64_t padded() const { return static_cast<int64_t>(x.size()); }
};

/// Computes the sums over all sources j other than i that the left side needs, for the targets
/// begin ... end - 1 (multiples of kSweepGrain). g is exp(i pi u)/u, u the distance, and e the
/// vector from target to source.
///
///     sums 0, 1:    sum of g (d/u^2 - i (pi d/u + n_i . N_j)) p_j,     d = N_j . e
///     sums 2 ... 7: sum of g J_j
///
/// `sources` has `source_count` records of kSourceHead + sides * kSourceSide floats. Sum q of side
/// s and target i is number (s * kSweepSums + q) * targets.padded() + i of `sums`.
void SweepLeft(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
               int64_t begin, int64_t end, float* sums);

/// Computes the sums of the right side. Each source has its position and then `sides` strengths
/// s_j, all floats.
///
///     sums 0, 1:    sum of g s_j
///     sums 2, 3:    sum of g (1/u - i pi) (n_i . e)/u s_j
///
/// Sum q of target i is number (side * 4 + q) * targets.padded() + i of `sums`.
void SweepRight(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
                int64_t begin, int64_t end, float* sums);

/// Computes the sums of the far pattern. `targets` are directions, whose normals are not used. Each
/// source has nine floats: position, area vector, b (complex) and s.
///
///     sums 0, 1:  sum of exp(-i pi d . y_j) ((d . N_j) b_j - s_j)
///
/// Sum q of direction i is number q * targets.padded() + i of `sums`.
void SweepFar(const SweepTargets& targets, const float* sources, int64_t source_count,
              int64_t begin, int64_t end, float* sums);

}  // namespace carillon::precompute
