// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/element.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "precompute/fem/assembly.h"
#include "precompute/fem/curved_element.h"
#include "precompute/fem/elastic_constants.h"
#include "precompute/fem/tet_rule.h"
#include "precompute/mesh/curved_edges.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr LameConstants kLame{.lambda_pa = 2.1, .mu_pa = 1.3};
constexpr double kDensity = 3.7;

/// The corners of a tetrahedron without symmetry, and the middles of its edges.
TenNodes AnyNodes() {
  TenNodes nodes;
  nodes.leftCols<4>() << 0.1, 1.2, 0.3, 0.2,  //
      -0.2, 0.1, 0.9, 0.3,                    //
      0.0, 0.2, -0.1, 1.1;
  for (size_t e = 0; e < 6; ++e) {
    const auto& [i, j] = kTetEdges[e];
    nodes.col(static_cast<Eigen::Index>(4 + e)) = (nodes.col(i) + nodes.col(j)) / 2;
  }
  return nodes;
}

/// A displacement gradient, and its energy density in linear elasticity.
const Eigen::Matrix3d kGradient{{0.3, -0.7, 0.2}, {0.5, 0.1, 0.9}, {-0.4, 0.6, -0.8}};
double EnergyDensity() {
  const Eigen::Matrix3d strain = (kGradient + kGradient.transpose()) / 2;
  return kLame.lambda_pa / 2 * strain.trace() * strain.trace() + kLame.mu_pa * strain.squaredNorm();
}

/// Expects that exactly six motions have no energy, and that a displacement of constant gradient
/// has the energy that the theory of elasticity gives.
template <int N>
void ExpectStiffness(const Eigen::Matrix<double, 3 * N, 3 * N>& k, const TenNodes& nodes,
                     double volume_m3, double rounding) {
  const Eigen::Matrix<double, 3 * N, 1> eigenvalues =
      k.template selfadjointView<Eigen::Lower>().eigenvalues();
  EXPECT_NEAR(eigenvalues.template head<6>().cwiseAbs().maxCoeff(), 0, rounding);
  EXPECT_GT(eigenvalues[6], 1e-2);
  const Eigen::Matrix<double, 3, N> moved =
      (kGradient * nodes.leftCols<N>()).colwise() + Eigen::Vector3d(1, 2, 3);
  const Eigen::Matrix<double, 3 * N, 1> u = moved.reshaped();
  EXPECT_NEAR(u.dot(k * u) / 2, volume_m3 * EnergyDensity(), 1e-13);
}

Eigen::Matrix<double, 3, 4> Corners() { return AnyNodes().leftCols<4>(); }

TEST(Stiffness, IsThatOfElasticityAndLetsExactlySixMotionsFree) {
  const TetGeometry geometry = MakeTetGeometry(Corners());
  const double volume_m3 = geometry.volume_m3;
  ExpectStiffness<4>(MakeLinearStiffness(geometry, kLame), AnyNodes(), volume_m3, 1e-14);
  ExpectStiffness<10>(MakeQuadraticStiffness(geometry, kLame), AnyNodes(), volume_m3, 1e-13);
}

// The paper's eq. 12 is the second derivative of its eq. 10, the energy of the Green strain, at
// rest.
TEST(LinearStiffness, IsTheSecondDerivativeOfTheEnergyOfGreensStrain) {
  const TetGeometry geometry = MakeTetGeometry(Corners());
  const auto energy = [&](const Eigen::Matrix<double, 12, 1>& u) {
    const Eigen::Matrix3d gradient = u.reshaped(3, 4) * geometry.gradients;  // du_a/dx_b
    const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + gradient;
    const Eigen::Matrix3d green = (F.transpose() * F - Eigen::Matrix3d::Identity()) / 2;
    return geometry.volume_m3 * (kLame.lambda_pa / 2 * green.trace() * green.trace() +
                                 kLame.mu_pa * green.squaredNorm());
  };
  const LinearStiffness k = MakeLinearStiffness(geometry, kLame);
  const double h = 1e-4;  // the fourth-difference error h^2 and rounding eps/h^2 are both near 1e-8
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) {
      const auto at = [&](double a, double b) {
        Eigen::Matrix<double, 12, 1> u = Eigen::Matrix<double, 12, 1>::Zero();
        u[i] += a;
        u[j] += b;
        return energy(u);
      };
      const double derivative = (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / (4 * h * h);
      EXPECT_NEAR(k(i, j), derivative, 1e-6) << i << " " << j;
    }
  }
}

// u = (x^2, 0, 0) strains by 2x along x: energy (lambda/2 + mu) times the integral of 4 x^2, which
// is exact for quadratic elements. Integral of x^2 over a tetrahedron: vol/20 (sum x_i^2 + (sum
// x_i)^2).
TEST(QuadraticStiffness, EnergyOfQuadraticDisplacementIsExact) {
  const TetGeometry geometry = MakeTetGeometry(Corners());
  const TenNodes nodes = AnyNodes();
  Eigen::Matrix<double, 30, 1> u = Eigen::Matrix<double, 30, 1>::Zero();
  for (int i = 0; i < 10; ++i) u[3 * i] = nodes(0, i) * nodes(0, i);
  const Eigen::RowVector4d x = Corners().row(0);
  const double integral = geometry.volume_m3 / 20 * (x.squaredNorm() + x.sum() * x.sum());
  EXPECT_NEAR(u.dot(MakeQuadraticStiffness(geometry, kLame) * u) / 2,
              (kLame.lambda_pa / 2 + kLame.mu_pa) * 4 * integral, 1e-13);
}

TEST(Mass, SumsToDensityTimesVolume) {
  for (const MassSharing sharing : {MassSharing::kConsistent, MassSharing::kLumped}) {
    EXPECT_NEAR(MakeLinearMass(2, kDensity, sharing).sum(), 2 * kDensity, 1e-14);
    EXPECT_NEAR(MakeQuadraticMass(2, kDensity, sharing).sum(), 2 * kDensity, 1e-14);
  }
}

TEST(Mass, ConsistentMassIntegratesProductsOfAffineFunctions) {
  const double volume = MakeTetGeometry(Corners()).volume_m3;
  const TenNodes nodes = AnyNodes();
  const Eigen::RowVector4d x = Corners().row(0);
  const Eigen::RowVector4d y = Corners().row(1);
  const double exact = kDensity * volume / 20 * (x.dot(y) + x.sum() * y.sum());
  EXPECT_NEAR(x * MakeLinearMass(volume, kDensity, MassSharing::kConsistent) * y.transpose(), exact,
              1e-15);
  EXPECT_NEAR(nodes.row(0) * MakeQuadraticMass(volume, kDensity, MassSharing::kConsistent) *
                  nodes.row(1).transpose(),
              exact, 1e-15);
}

// Integral of L0^4 over a tetrahedron of volume 1: 4! 3!/7! = 1/35.
TEST(Mass, ConsistentQuadraticMassIntegratesFourthPowers) {
  Eigen::Matrix<double, 10, 1> squared = Eigen::Matrix<double, 10, 1>::Zero();
  squared[0] = 1;
  for (const int e : {4, 6, 7}) squared[e] = 0.25;  // the edges at corner 0
  const QuadraticMass mass = MakeQuadraticMass(1, 1, MassSharing::kConsistent);
  EXPECT_NEAR(squared.dot(mass * squared), 1.0 / 35, 1e-16);
}

TEST(Mass, LumpedQuadraticMassGivesCornersA36thAndMidsidesFour27ths) {
  const QuadraticMass mass = MakeQuadraticMass(1, 1, MassSharing::kLumped);
  EXPECT_NEAR(mass(0, 0), 1.0 / 36, 1e-16);
  EXPECT_NEAR(mass(9, 9), 4.0 / 27, 1e-16);
  EXPECT_TRUE(mass.isDiagonal());
}

TEST(ElasticConstants, UniaxialStressOfLameConstantsIsYoungsModulus) {
  // With strain (1, -nu, -nu), sigma_ij = lambda tr(e) delta_ij + 2 mu e_ij must be (E, 0, 0).
  const ElasticConstants elastic{.young_pa = 70e9, .poisson_ratio = 0.33};
  const auto [lambda, mu] = ToLame(elastic);
  const double trace = 1 - 2 * elastic.poisson_ratio;
  EXPECT_NEAR(lambda * trace + 2 * mu, elastic.young_pa, 1e-4);  // 15 digits of 7e10
  EXPECT_NEAR(lambda * trace - 2 * mu * elastic.poisson_ratio, 0, 1e-4);
}

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
