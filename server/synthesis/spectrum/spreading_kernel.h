// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "server/synthesis/spectrum/long_block.h"

namespace carillon {

/// Number of bins that a mode is spread over.
inline constexpr size_t kSpreadBins = 8;

/// The contribution of a mode with unit state to the spectrum of a long block.
struct SpreadMode {
  size_t slot = 0;  ///< its first bin, plus kSpreadBins/2: never negative
  std::array<std::complex<float>, kSpreadBins> weights;
};

/// Number of slots of a spectrum with `grid_size` points, for modes from zero to Nyquist.
constexpr size_t SlotCount(size_t grid_size) { return grid_size / 2 + kSpreadBins; }

/// Type-1 non-uniform Fourier transform (Dutt and Rokhlin 1993) with the Kaiser-Bessel kernel
///
///   phi(x) = I0(beta sqrt(1 - (2x/w)^2)) / I0(beta),  |x| <= w/2,  w = kSpreadBins
///
/// of a mode that decays: with theta = omega - i sigma, frames n' = n - N/2 and grid size M >= 2N,
///
///   exp(i theta n') = sum_k phi(k - theta M/(2 pi)) exp(2 pi i k n'/M) / Phi(n'/M),
///
/// where phi is continued to complex arguments. The weights include exp(i theta N/2), so that they
/// multiply the state at the block's first frame.
SpreadMode MakeSpreadMode(std::complex<double> log_q, const LongBlock& block);

/// 1/Phi(n'/M) for n' = -N/2 ... N/2 - 1, where Phi is the Fourier transform of phi.
std::vector<float> MakeDeconvolution(const LongBlock& block);

}  // namespace carillon
