// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/element.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/precompute/fem/any_tetrahedron.h"

namespace carillon::precompute {
namespace {

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

}  // namespace
}  // namespace carillon::precompute
