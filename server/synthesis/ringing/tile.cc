// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/tile.h"

#include <cmath>
#include <numbers>

namespace carillon {
namespace {

/// Bounds for a mode in a tile: |log q| times half the tile's frames, and -Re log q times all of
/// them. The interpolation error is then at most -116 dB, or -110 dB for the fastest decay.
constexpr double kMostHalfTileRadians = 2.4;
constexpr double kMostDecay = 0.5;
/// The polynomial's highest frequency relative to the fastest mode's, chosen for the least error.
constexpr double kHighestFrequency = 1.04;

NodeShares MakeNodeShares(size_t kind) noexcept {
  constexpr double kHarmonics = double{kTileNodes} / 2;
  const double half_step = kHighestFrequency * kMostHalfTileRadians /
                           (kHarmonics * static_cast<double>(kTileFrames[kind]));
  NodeShares shares{};
  for (size_t frame = 0; frame < kTileFrames[kind]; ++frame) {
    for (size_t node = 0; node < kClosedTileNodes; ++node) {
      double share = 1;
      for (size_t other = 0; other < kClosedTileNodes; ++other) {
        if (other == node) continue;
        const double from = TileNode(kind, other);
        share *= std::sin(half_step * (static_cast<double>(frame) - from)) /
                 std::sin(half_step * (TileNode(kind, node) - from));
      }
      shares[node][frame] = static_cast<float>(share);
    }
  }
  return shares;
}

/// The shares are computed at the program's start, before any thread renders.
const std::array<NodeShares, kTileKinds> kShares = {NodeShares{}, MakeNodeShares(1),
                                                    MakeNodeShares(2)};

}  // namespace

size_t ChooseTile(std::complex<double> log_q) {
  for (size_t kind = kTileKinds - 1; kind > 0; --kind) {
    const auto frames = static_cast<double>(kTileFrames[kind]);
    if (std::abs(log_q) * frames / 2 <= kMostHalfTileRadians &&
        -log_q.real() * frames <= kMostDecay) {
      return kind;
    }
  }
  return 0;
}

double TileNode(size_t kind, size_t node) {
  if (kind == 0) return static_cast<double>(node);
  const double angle = std::numbers::pi * static_cast<double>(node) / kTileNodes;
  return static_cast<double>(kTileFrames[kind]) * (1 - std::cos(angle)) / 2;
}

const NodeShares& GetNodeShares(size_t kind) noexcept { return kShares[kind]; }

}  // namespace carillon
