// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/node_ordering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

SystemMatrices BoxSystem(const std::array<int, 3>& cells) {
  const TetMesh mesh = MakeTetBox({1, 1, 0.03}, cells, 4);
  return Assemble(mesh, {.young_pa = 1, .poisson_ratio = 0.3}, 1, MassSharing::kLumped);
}

TEST(OrderThinWall, OrdersEachNodeOfAPlateOnce) {
  const SystemMatrices plate = BoxSystem({24, 24, 1});
  std::vector<int> order = OrderThinWall(plate.K);
  std::ranges::sort(order);
  std::vector<int> all(static_cast<size_t>(plate.K.cols() / 3));
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(order, all);
}

TEST(OrderThinWall, LeavesThickerBodiesAlone) {
  EXPECT_TRUE(OrderThinWall(BoxSystem({24, 24, 2}).K).empty());
  EXPECT_TRUE(OrderThinWall(BoxSystem({9, 9, 9}).K).empty());
}

}  // namespace
}  // namespace carillon::precompute
