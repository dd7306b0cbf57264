// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>

namespace carillon {

/// What rings in the time domain is rendered tile by tile: one state gives kTileNodes values and
/// the next tile's state. Of the first kind of tile the values are samples. A mode that turns
/// slowly goes in longer tiles of as many values, taken at the tile's nodes; they are added up over
/// all modes and only then interpolated. Of these tiles the end is a node too.
inline constexpr size_t kTileKinds = 3;
inline constexpr std::array<size_t, kTileKinds> kTileFrames = {8, 16, 64};
inline constexpr size_t kTileNodes = 8;
inline constexpr size_t kClosedTileNodes = kTileNodes + 1;

/// The longest first.
inline constexpr std::array<size_t, kTileKinds> kTileOrder = {2, 1, 0};

/// The longest kind of tile that renders a mode to -110 dB of its amplitude at the tile's begin,
/// which may be 4 dB above that of a strike late in the tile; `log_q` is (sigma + i omega)/rate.
/// Within it the mode makes less than a whole turn.
size_t ChooseTile(std::complex<double> log_q);

/// Where a node is, in frames from the tile's begin: of longer tiles Chebyshev's points with both
/// ends (of the second kind; Trefethen, Approximation Theory and Approximation Practice, 2).
double TileNode(size_t kind, size_t node);

/// The share of each node's value in each frame of a tile: [node][frame], zero behind the tile's
/// end. Interpolation is by a trigonometric polynomial (Gauss's formula; Zygmund, Trigonometric
/// Series, X.1), which for what rings below a known frequency reaches half as far again as an
/// algebraic one.
using NodeShares = std::array<std::array<float, 80>, kClosedTileNodes>;
const NodeShares& GetNodeShares(size_t kind) noexcept;

}  // namespace carillon
