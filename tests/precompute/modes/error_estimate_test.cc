// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/error_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "precompute/mesh/point_math.h"
#include "precompute/modes/reentrant_edges.h"
#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

// The coarsest meshes are far from fine enough for linear elements.
TEST(ErrorEstimate, IsNearTheTrueErrorAndSeldomBelowIt) {
  const Point size{1, 0.4, 0.3};
  constexpr double kLimit = 60;
  const DeformationModes fine = ModesBelow(kLimit, MakeTetBox(size, {20, 8, 6}, 10));
  for (const TetMesh& mesh : {MakeTetBox(size, {12, 4, 3}, 4), MakeTetBox(size, {24, 8, 6}, 4),
                              MakeTetBox(size, {6, 3, 2}, 10), MakeTetBox(size, {12, 5, 3}, 10)}) {
    SCOPED_TRACE(mesh.nodes.size());
    const DeformationModes coarse = ModesBelow(2 * kLimit, mesh);
    ASSERT_GE(coarse.modes.eigenvalues.size(), fine.modes.eigenvalues.size());
    // Further up the coarsest mesh has other modes in between. The fine mesh has an error of its
    // own, some 1e-5.
    ExpectErrorsNearTruth(mesh, coarse, fine, 6, {.least = 0.8, .most = 3, .beside = 2e-5});
  }
}

TEST(ErrorEstimate, HasItsLargestSharesWhereElementsAreCoarse) {
  // Cells that are four times as long in the half of high x.
  TetMesh mesh = MakeTetBox({1, 0.2, 0.2}, {20, 2, 2}, 4);
  for (Point& p : mesh.nodes) p[0] = p[0] < 0.5 ? p[0] : 0.5 + 4 * (p[0] - 0.5);
  const DeformationModes solution = ModesBelow(60, mesh);
  ASSERT_GT(solution.modes.eigenvalues.size(), 0);
  const std::vector<double> at_node =
      EstimateFrequencyErrors(mesh, kUnitElastic, solution.modes).at_node;
  ASSERT_EQ(at_node.size(), mesh.nodes.size());
  double fine = 0, coarse = 0;
  for (size_t n = 0; n < at_node.size(); ++n) {
    EXPECT_GE(at_node[n], 0);
    (mesh.nodes[n][0] < 0.5 ? fine : coarse) += at_node[n];
  }
  EXPECT_GT(fine, 0);
  EXPECT_GT(coarse, 3 * fine);
}

TEST(EstimateOfCurvedElements, IsNearTheTrueErrorAndSeldomBelowIt) {
  constexpr double kLimit = 4;
  const DeformationModes fine = ModesBelow(kLimit, MakeTetSphere(1, 700, true));
  const TetMesh mesh = MakeTetSphere(1, 150, true);
  const DeformationModes coarse = ModesBelow(kLimit * 1.1, mesh);
  // The constant of the estimate is fitted to straight elements.
  ExpectErrorsNearTruth(mesh, coarse, fine, 10, {.least = 0.7, .most = 3, .least_true = 1e-4});
}

constexpr double kLegM = 0.03, kWallM = 0.01, kLengthM = 0.04;

/// An L profile along the z axis whose inner edge is at x = y = kWallM.
TetMesh Angle(int cells_in_wall) {
  const TetMesh box = MakeTetBox({kLegM, kLegM, kLengthM},
                                 {3 * cells_in_wall, 3 * cells_in_wall, 3 * cells_in_wall}, 10);
  return Part(box, [](const Point& p) { return p[0] < kWallM || p[1] < kWallM; });
}

bool IsOnInnerEdge(const Point& p) {
  return std::abs(p[0] - kWallM) < 1e-9 && std::abs(p[1] - kWallM) < 1e-9;
}

TEST(PlaceWeights, AreNoneOfAConvexBody) {
  for (const double value : PlaceWeights(MakeTetBox({1, 2, 3}, {2, 3, 4}, 4))) {
    EXPECT_EQ(value, 1);
  }
}

TEST(PlaceWeights, AreThoseOfTheInnerEdgeOfAnAngle) {
  const TetMesh mesh = Angle(2);
  const std::vector<double> values = PlaceWeights(mesh);
  ASSERT_EQ(values.size(), mesh.nodes.size());
  int count = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t i = 0; i < 4; ++i) {
      const auto node = static_cast<size_t>(mesh.elements[10 * e + i]);
      EXPECT_NEAR(values[node], IsOnInnerEdge(mesh.nodes[node]) ? 2 : 1, 1e-9);
      count += values[node] > 1 ? 1 : 0;
    }
  }
  EXPECT_GT(count, 0);
}

/// A plate of 12 elements that is bent by a right angle to an arc with this inner radius.
TetMesh BentPlate(double inner_radius_m) {
  constexpr double kThicknessM = 0.004, kWidthM = 0.02;
  TetMesh mesh = MakeTetBox({1, kThicknessM, kWidthM}, {12, 2, 10}, 4);
  for (Point& p : mesh.nodes) {
    const double angle = p[0] * std::numbers::pi / 2;
    const double radius = inner_radius_m + kThicknessM - p[1];
    p = {radius * std::sin(angle), -radius * std::cos(angle), p[2]};
  }
  return mesh;
}

/// The weights in the middle of the inner side and of the outer side of BentPlate().
std::pair<double, double> InnerAndOuterWeight(double inner_radius_m) {
  const TetMesh mesh = BentPlate(inner_radius_m);
  const std::vector<double> weights = PlaceWeights(mesh);
  const auto at = [&](double radius) {
    const Point sought = {radius * std::sqrt(0.5), -radius * std::sqrt(0.5), 0.01};
    const auto near = [&](const Point& p) { return Norm(Difference(p, sought)); };
    const auto found = std::ranges::min_element(mesh.nodes, {}, near);
    EXPECT_LT(near(*found), 1e-9);
    return weights[static_cast<size_t>(found - mesh.nodes.begin())];
  };
  return {at(inner_radius_m), at(inner_radius_m + 0.004)};
}

TEST(PlaceWeights, OfAFilletRiseWithWhatItTurnsWithinTwoElements) {
  const auto [narrow, outside] = InnerAndOuterWeight(0.001);
  EXPECT_GT(narrow, 1.6);
  EXPECT_EQ(outside, 1);
  const double middle = InnerAndOuterWeight(0.01).first;
  const double wide = InnerAndOuterWeight(0.1).first;
  EXPECT_LT(middle, narrow);
  EXPECT_LT(wide, middle);
  // Each edge turns by a twelfth of a right angle.
  EXPECT_GE(wide, 1 + std::sqrt(1.0 / 12) - 1e-9);
}

TEST(PlaceWeights, RiseWithTheWidthOfElementsInAFlatWall) {
  const auto greatest = [](double thickness_m) {
    return std::ranges::max(PlaceWeights(MakeTetBox({1, 1, thickness_m}, {4, 4, 1}, 10)));
  };
  EXPECT_EQ(greatest(0.25), 1);
  const double four = greatest(0.25 / 4), eight = greatest(0.25 / 8);
  EXPECT_GT(four, 1.4);
  EXPECT_LT(four, 2.5);
  EXPECT_GT(eight, 1.6 * four);
}

// A plate whose elements are four times as wide as high.
TEST(ErrorEstimate, CoversTheErrorsOfAThinPlate) {
  constexpr double kLimit = 0.5;
  constexpr Point kPlate = {1, 0.75, 0.03125};
  const TetMesh mesh = MakeTetBox(kPlate, {8, 6, 1}, 10);
  const DeformationModes fine = ModesBelow(kLimit, MakeTetBox(kPlate, {24, 18, 1}, 10));
  const DeformationModes coarse = ModesBelow(1.3 * kLimit, mesh);
  ExpectErrorsNearTruth(mesh, coarse, fine, 6, {.least = 1, .most = 2.5});
}

TEST(ErrorEstimate, CoversTheErrorsOfABodyWithAReentrantEdge) {
  const TetMesh mesh = Angle(1);
  const DeformationModes coarse = ModesBelow(4e4, mesh), fine = ModesBelow(4e4, Angle(4));
  ExpectErrorsNearTruth(mesh, coarse, fine, 4, {.least = 1, .most = 3, .least_true = 1e-3});
}

}  // namespace
}  // namespace carillon::precompute
