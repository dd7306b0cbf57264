// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/tile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace carillon {
namespace {

using Complex = std::complex<double>;

/// Largest deviation of the interpolated mode from the mode itself, over its amplitude at the
/// tile's begin; decibels.
double InterpolationErrorDb(size_t kind, Complex log_q) {
  const NodeShares& shares = GetNodeShares(kind);
  double error = 0;
  for (size_t frame = 0; frame < kTileFrames[kind]; ++frame) {
    Complex value = 0;
    for (size_t node = 0; node < kClosedTileNodes; ++node) {
      value += double{shares[node][frame]} * std::exp(log_q * TileNode(kind, node));
    }
    error = std::max(error, std::abs(value - std::exp(log_q * static_cast<double>(frame))));
  }
  return 20 * std::log10(error);
}

Complex LogQ(double radians, double decay) { return {-decay, radians}; }

TEST(Tile, AModeIsInterpolatedTo110DecibelsInTheTileThatIsChosenForIt) {
  size_t chosen[kTileKinds] = {};
  for (double radians = 1e-3; radians < std::numbers::pi; radians *= 1.01) {
    for (const double decay : {0.0, 1e-6, 1e-4, 2e-3, 7.8e-3, 3e-2}) {
      const size_t kind = ChooseTile(LogQ(radians, decay));
      ++chosen[kind];
      if (kind == 0) continue;
      EXPECT_LT(InterpolationErrorDb(kind, LogQ(radians, decay)), -110)
          << "kind " << kind << ", " << radians << " radians a frame, decay " << decay;
    }
  }
  for (const size_t count : chosen) EXPECT_GT(count, 100U);
}

TEST(Tile, AThirdMoreThanTheFastestModeOfATileIsTooFastForIt) {
  for (const size_t kind : {1U, 2U}) {
    double radians = 1e-3;
    while (ChooseTile(LogQ(radians, 0)) >= kind) radians *= 1.001;
    EXPECT_GT(InterpolationErrorDb(kind, LogQ(1.33 * radians, 0)), -110);
  }
}

TEST(Tile, StrikesAreTakenBackThroughLessThanATurnAndLittleDecay) {
  for (const size_t kind : {1U, 2U}) {
    const auto frames = static_cast<double>(kTileFrames[kind]);
    EXPECT_LT(ChooseTile(LogQ(2 * std::numbers::pi / frames, 0)), kind);
    EXPECT_LT(ChooseTile(LogQ(0, 0.6 / frames)), kind);
  }
}

TEST(Tile, AtItsNodesAValueIsItself) {
  for (const size_t kind : {1U, 2U}) {
    EXPECT_EQ(TileNode(kind, 0), 0);
    EXPECT_DOUBLE_EQ(TileNode(kind, kTileNodes), static_cast<double>(kTileFrames[kind]));
    // The first and the middle one of the nodes that lie at frames.
    const auto middle = static_cast<size_t>(std::lround(TileNode(kind, kTileNodes / 2)));
    for (size_t node = 0; node < kClosedTileNodes; ++node) {
      EXPECT_NEAR(GetNodeShares(kind)[node][0], node == 0 ? 1 : 0, 1e-7);
      EXPECT_NEAR(GetNodeShares(kind)[node][middle], node == kTileNodes / 2 ? 1 : 0, 1e-7);
    }
  }
}

}  // namespace
}  // namespace carillon
