// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

/// Loops over samples and frames that the mixer and its buses share. The channels of a frame are
/// interleaved. Nothing here allocates, locks, logs, throws or calls the
/// system, and compilers vectorise each loop.
namespace carillon {

/// sum[n] += more[n].
void AddTo(std::span<const float> more, std::span<float> sum) noexcept;

/// Writes each sample of `mono` to all channels of its frame or, if it has more than two, to the
/// first, and zero to the others.
void Spread(std::span<const float> mono, size_t channel_count, std::span<float> frames) noexcept;

/// Multiplies all channels of each frame by its gain.
void MultiplyFrames(std::span<const float> gains, size_t channel_count,
                    std::span<float> frames) noexcept;

/// The largest magnitude, 0 where there are no samples. Infinity counts as larger than any number,
/// and a NaN as larger than infinity.
float LargestMagnitude(std::span<const float> samples) noexcept;

}  // namespace carillon
