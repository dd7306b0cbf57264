// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <span>
#include <vector>

namespace carillon::fit {

/// A signal that is sampled evenly.
using Signal = std::span<const std::complex<double>>;

/// Finds the poles z of signals x_n = sum_k a_k z_k^n by ESPRIT (Roy and Kailath, IEEE Trans. ASSP
/// 37, 1989). The signals share their poles, not their amplitudes. Their Hankel matrices of
/// `height` rows stand side by side; signals shorter than that add nothing.
///
/// Returns the poles for each model order from 1 to `most_order`, result[order - 1]. Returns
/// nothing if every signal is too short.
std::vector<std::vector<std::complex<double>>> EspritPoles(const std::vector<Signal>& signals,
                                                           int height, int most_order);

/// Returns the amplitudes a_k that fit a signal best, by least squares. There must be fewer poles
/// than samples.
std::vector<std::complex<double>> Amplitudes(Signal signal,
                                             const std::vector<std::complex<double>>& poles);

}  // namespace carillon::fit
