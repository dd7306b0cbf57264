// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace carillon::convolution_kernel {

/// Convolves the taps with a signal: sound[n] = sum over k of taps[k] signal[taps.size() - 1 + n -
/// k]. `signal` has taps.size() - 1 frames more than `sound`. Compiled for every SIMD target and
/// dispatched at run time; neither allocates, locks nor throws.
void Convolve(std::span<const float> taps, std::span<const float> signal,
              std::span<float> sound) noexcept;

}  // namespace carillon::convolution_kernel
