// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/tile.h"

#include <cmath>
#include <numbers>

namespace carillon {
namespace {

/// A mode may turn by so much in half a tile, |log q| frames/2, and decay by so much in a whole
/// one: interpolation errs by -119 dB then, by -113 dB of what decays most.
constexpr double kMostHalfTurn = 2.4;
constexpr double kMostDecay = 0.5;
/// The highest frequency of the interpolating polynomial, in the fastest mode's: it errs least so.
constexpr double kHighestFrequency = 1.04;

NodeShares MakeNodeShares(size_t kind) noexcept {
  constexpr double kHarmonics = double{kTileNodes} / 2;
  const double half_step =
      kHighestFrequency * kMostHalfTurn / (kHarmonics * static_cast<double>(kTileFrames[kind]));
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

/// Made before any thread renders.
const std::array<NodeShares, kTileKinds> kShares = {NodeShares{}, MakeNodeShares(1),
                                                    MakeNodeShares(2)};

}  // namespace

size_t ChooseTile(std::complex<double> log_q) {
  for (size_t kind = kTileKinds - 1; kind > 0; --kind) {
    const auto frames = static_cast<double>(kTileFrames[kind]);
    if (std::abs(log_q) * frames / 2 <= kMostHalfTurn && -log_q.real() * frames <= kMostDecay) {
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
