// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>

namespace carillon {

/// Ringing modes are rendered tile by tile: from the state at a tile's start, kTileNodes values and
/// the next tile's state are computed. In tiles of the first kind the values are the samples. Modes
/// of low frequency use longer tiles with the same number of values, taken at Chebyshev nodes; the
/// values are summed over all modes and interpolated once. In longer tiles the end is a node too.
///
///   kind 0,  8 frames  01234567|
///   kind 1, 16 frames  012..3..4..5..678
///   kind 2, 64 frames  0.1......2..........3...........4...........5..........6......7.8
///
/// A column is a frame, a digit is a node, and node 8 lies where the next tile begins.
inline constexpr size_t kTileKinds = 3;
inline constexpr std::array<size_t, kTileKinds> kTileFrames = {8, 16, 64};
inline constexpr size_t kTileNodes = 8;
inline constexpr size_t kClosedTileNodes = kTileNodes + 1;

/// The kinds of tiles, longest first.
inline constexpr std::array<size_t, kTileKinds> kTileOrder = {2, 1, 0};

/// Returns the longest kind of tile that renders a mode with an error below -110 dB relative to its
/// amplitude at the tile's start. This amplitude may be 4 dB above that of an impulse late in the
/// tile. `log_q` is (sigma + i omega)/rate. Within the tile the mode completes less than a cycle.
size_t ChooseTile(std::complex<double> log_q);

/// Returns the position of a node, in frames from the tile's start. The nodes of longer tiles are
/// Chebyshev points of the second kind (Trefethen, Approximation Theory and Approximation Practice,
/// chapter 2).
double TileNode(size_t kind, size_t node);

/// Weights of the interpolation: the weight of each node in each frame, [node][frame], zero after
/// the tile's end. The interpolant is a trigonometric polynomial (Gauss's formula; Zygmund,
/// Trigonometric Series, X.1). For modes below a known frequency it allows tiles 1.5 times as long
/// as an algebraic polynomial does.
using NodeShares = std::array<std::array<float, 80>, kClosedTileNodes>;
const NodeShares& GetNodeShares(size_t kind) noexcept;

}  // namespace carillon
