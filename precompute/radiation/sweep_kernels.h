// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace carillon::precompute {

/// Vertices that a kernel takes at once: arrays over targets are padded to multiples of it.
inline constexpr int64_t kSweepGrain = 32;
/// Right-hand sides that one evaluation of the kernel may serve.
inline constexpr int kMaxSweepSides = 2;
/// Sums that a sweep makes of each target and side: real and imaginary parts of the scalar and of
/// the three components of the field of the curls.
inline constexpr int kSweepSums = 8;
/// Floats of each source before those of its sides: place, area vector.
inline constexpr int kSourceHead = 6;
/// Floats of each source and side: p, and three components of its curl, complex.
inline constexpr int kSourceSide = 8;

/// Vertices as targets, each array padded to kSweepGrain. Lengths are multiplied by k / pi, so
/// that a unit of distance is half a turn of phase.
struct SweepTargets {
  std::vector<float> x, y, z;
  std::vector<float> nx, ny, nz;  ///< normals, scaled as the operator needs them
  int64_t padded() const { return static_cast<int64_t>(x.size()); }
};

/// The sums over all sources j other than i that the left side needs, for targets begin ... end - 1
/// (multiples of kSweepGrain), with g = exp(i pi u)/u, u the distance and e from target to source:
///
///     sums 0, 1:    sum of g (d/u^2 - i (pi d/u + n_i . N_j)) p_j,     d = N_j . e
///     sums 2 ... 7: sum of g J_j
///
/// `sources`: `source_count` records of kSourceHead + sides * kSourceSide floats. `sums`: of side s
/// and sum q, number (s * kSweepSums + q) * targets.padded() + i.
void SweepLeft(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
               int64_t begin, int64_t end, float* sums);

/// The sums of the right side: of each source, its place and then `sides` strengths s_j, floats.
///
///     sums 0, 1:    sum of g s_j
///     sums 2, 3:    sum of g (1/u - i pi) (n_i . e)/u s_j
///
/// `sums`: number (side * 4 + q) * targets.padded() + i.
void SweepRight(const SweepTargets& targets, const float* sources, int64_t source_count, int sides,
                int64_t begin, int64_t end, float* sums);

/// The far pattern: `targets` are directions (n is not used), sources as in SweepLeft with the
/// amplitude's two parts in place of sides:
///
///     sums 0, 1:  sum of exp(-i pi d . y_j) ((d . N_j) b_j - s_j)
///
/// with sources of place, area vector, b (complex) and s: nine floats. `sums`: q * padded() + i.
void SweepFar(const SweepTargets& targets, const float* sources, int64_t source_count,
              int64_t begin, int64_t end, float* sums);

/// The instructions that the sweeps use on this machine: "AVX3", "AVX2", "NEON", ...
std::string SweepTargetName();

}  // namespace carillon::precompute
