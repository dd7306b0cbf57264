// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/curved_element.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "precompute/fem/assembly.h"
#include "precompute/fem/tet_rule.h"
#include "precompute/mesh/curved_edges.h"
#include "tests/precompute/fem/any_tetrahedron.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

/// Each mid-side node moved in a direction of its own, by a tenth of an edge or so.
TenNodes CurvedNodes() {
  TenNodes nodes = AnyNodes();
  for (int e = 0; e < 6; ++e) {
    nodes.col(4 + e) +=
        0.1 * Eigen::Vector3d(std::sin(1.0 + e), std::cos(2.0 * e), std::sin(3.0 * e));
  }
  return nodes;
}

// The integral of L0^a L1^b L2^c L3^d over a tetrahedron of volume one: a! b! c! d! 3! /
// (a+b+c+d+3)!.
TEST(TetRule, IntegratesPolynomialsOfItsDegree) {
  const auto exact = [](int a, int b, int c, int d) {
    return 6 * std::tgamma(a + 1) * std::tgamma(b + 1) * std::tgamma(c + 1) * std::tgamma(d + 1) /
           std::tgamma(a + b + c + d + 4);
  };
  for (const auto& [rule, degree] : {std::pair(&TetRuleOfDegree5(), 5), {&TetRuleOfDegree7(), 7}}) {
    for (int a = 0; a <= degree; ++a) {
      for (int b = 0; a + b <= degree; ++b) {
        const int c = (degree - a - b) / 2, d = degree - a - b - c;
        double sum = 0;
        for (const auto& [at, weight] : *rule) {
          sum += weight * std::pow(at[0], a) * std::pow(at[1], b) * std::pow(at[2], c) *
                 std::pow(at[3], d);
        }
        EXPECT_NEAR(sum / exact(a, b, c, d), 1, 1e-12) << degree << ": " << a << b << c << d;
      }
    }
  }
}

TEST(CurvedElement, IsTheStraightOneWhereItsEdgesAreStraight) {
  const TetGeometry geometry = MakeTetGeometry(AnyNodes().leftCols<4>());
  const TenNodes nodes = AnyNodes();
  EXPECT_NEAR(CurvedVolumeM3(nodes), geometry.volume_m3, 1e-15);
  EXPECT_NEAR((MakeCurvedStiffness(nodes, kLame) - MakeQuadraticStiffness(geometry, kLame)).norm(),
              0, 1e-13);
  for (const MassSharing sharing : {MassSharing::kConsistent, MassSharing::kLumped}) {
    EXPECT_NEAR((MakeCurvedMass(nodes, kDensity, sharing) -
                 MakeQuadraticMass(geometry.volume_m3, kDensity, sharing))
                    .norm(),
                0, 1e-15);
  }
}

TEST(CurvedElement, HasTheEnergyOfElasticityAndExactlySixMotionsWithoutIt) {
  const TenNodes nodes = CurvedNodes();
  ExpectStiffness<10>(MakeCurvedStiffness(nodes, kLame), nodes, CurvedVolumeM3(nodes), 1e-13);
}

// The mapping is a polynomial of third degree in the determinant, and of second in each function.
TEST(CurvedElement, MassIsTheIntegralOfProductsOfItsFunctions) {
  const TenNodes nodes = CurvedNodes();
  const QuadraticMass mass = MakeCurvedMass(nodes, kDensity, MassSharing::kConsistent);
  // The middles of n^3 cells of equal volume in the cube that collapses onto the tetrahedron.
  constexpr int kCells = 60;
  QuadraticMass sum = QuadraticMass::Zero();
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      for (int k = 0; k < kCells; ++k) {
        const double x = (i + 0.5) / kCells, y = (1 - x) * (j + 0.5) / kCells;
        const double z = (1 - x - y) * (k + 0.5) / kCells;
        const Eigen::Vector4d at(1 - x - y - z, x, y, z);
        const Eigen::Matrix3d jacobian = nodes * QuadraticGradients(ReferenceGradients(), at);
        const Eigen::Matrix<double, 10, 1> values = QuadraticValues(at);
        sum += (1 - x) * (1 - x - y) * jacobian.determinant() * values * values.transpose();
      }
    }
  }
  sum *= kDensity / (kCells * kCells * kCells);
  EXPECT_NEAR((mass - sum).norm() / mass.norm(), 0, 1e-3);  // their error falls with n^2
  EXPECT_NEAR(mass.sum(), kDensity * CurvedVolumeM3(nodes), 1e-14);
  EXPECT_NEAR(MakeCurvedMass(nodes, kDensity, MassSharing::kLumped).sum(), mass.sum(), 1e-14);
}

// The ball's volume is off by the fourth power of the elements' length, not by the second.
TEST(CurvedElement, FillsABallWhoseSurfaceItFollows) {
  const TetMesh straight = MakeTetSphere(1, 700, false), curved = MakeTetSphere(1, 700, true);
  const double exact = 4 * std::numbers::pi / 3;
  EXPECT_LT(VolumeM3(straight) / exact, 0.99);
  EXPECT_NEAR(VolumeM3(curved) / exact, 1, 1e-4);
  EXPECT_TRUE(CheckCurvedElements(curved).ok());
}

// Rounding of seven digits in a file is no curve: the matrices are those of straight elements, bit
// for bit.
TEST(CurvedElement, EdgesWithinAMillionthAreStraight) {
  const TetMesh box = MakeTetBox({1, 0.6, 0.3}, {2, 1, 1}, 10);
  TetMesh rounded = box;
  for (size_t n = box.nodes.size() - 1; n > box.nodes.size() - 9; --n) rounded.nodes[n][0] += 1e-8;
  const auto stiffness = [](const TetMesh& mesh) {
    return Assemble(mesh, {.young_pa = 1, .poisson_ratio = 0.3}, 1, MassSharing::kConsistent).K;
  };
  EXPECT_EQ((stiffness(box) - stiffness(rounded)).norm(), 0);
  rounded.nodes.back()[0] += 1e-4;
  EXPECT_GT((stiffness(box) - stiffness(rounded)).norm(), 0);
}

TEST(CurvedElement, OneTurnedInsideOutIsRefusedByItsNumber) {
  TetMesh box = MakeTetBox({1, 0.6, 0.3}, {2, 1, 1}, 10);
  constexpr size_t kElement = 3;
  const int32_t* nodes = &box.elements[10 * kElement];
  const Point corner = box.nodes[static_cast<size_t>(nodes[0])];
  const Point other = box.nodes[static_cast<size_t>(nodes[1])];
  Point& middle = box.nodes[static_cast<size_t>(nodes[4])];
  for (size_t x = 0; x < 3; ++x) middle[x] = 0.9 * corner[x] + 0.1 * other[x];
  const std::string refused = CheckCurvedElements(box).ToString();
  EXPECT_THAT(refused, HasSubstr("MESH_ELEMENT_INVERTED: tetrahedron "));
  EXPECT_THAT(refused, HasSubstr("is not positive"));
}

}  // namespace
}  // namespace carillon::precompute
