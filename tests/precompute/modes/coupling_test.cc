// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/coupling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "precompute/modes/poisson_slopes.h"
#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

/// The integral by the middle points of n^2 equal parts of the triangle.
double Sampled(double area, double f0, double f1, double f2, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < 2 * (n - i) - 1; ++j) {
      const double row = (i + (j % 2 == 0 ? 1.0 : 2.0) / 3) / n;
      const double column = (std::floor(0.5 * j) + (j % 2 == 0 ? 1.0 : 2.0) / 3) / n;
      sum += std::abs(f0 * (1 - row - column) + f1 * row + f2 * column);
    }
  }
  return area * sum / (n * n);
}

TEST(IntegralOfAbsolute, AgreesWithSamplingWhereverTheSignChanges) {
  for (const double f0 : {-2.0, -0.5, 0.0, 1.0}) {
    for (const double f1 : {-1.0, 0.0, 0.3, 2.0}) {
      for (const double f2 : {-0.7, 0.0, 0.1, 3.0}) {
        EXPECT_NEAR(IntegralOfAbsolute(1.5, f0, f1, f2), Sampled(1.5, f0, f1, f2, 200), 1e-4)
            << f0 << " " << f1 << " " << f2;
      }
    }
  }
}

/// One made-up mode: displacement f(position) at each node, eigenvalue 4.
template <typename F>
double CouplingOf(const TetMesh& mesh, F f) {
  Modes modes{.eigenvalues = Eigen::VectorXd::Constant(1, 4.0),
              .shapes = Eigen::MatrixXd(3 * static_cast<Eigen::Index>(mesh.nodes.size()), 1)};
  for (size_t i = 0; i < mesh.nodes.size(); ++i) {
    modes.shapes.block<3, 1>(3 * static_cast<Eigen::Index>(i), 0) = f(mesh.nodes[i]);
  }
  return Couplings(mesh, MakeSoundingSurface(mesh), modes)[0];
}

// On a box of 1 x 0.6 x 0.3, u = (2x - 1, 0, 0) moves two faces of 0.18 m^2 by 1 along their
// normals: twice omega = 2 times that.
TEST(Couplings, AreFrequencyTimesTheAreaMoved) {
  for (const int nodes : {4, 10}) {
    const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, {3, 2, 2}, nodes);
    EXPECT_NEAR(
        CouplingOf(mesh, [](const Point& p) { return Eigen::Vector3d(2 * p[0] - 1, 0, 0); }),
        2 * 2 * 0.18, 1e-12);
  }
}

// Breathing moves the whole sphere by one along its normal. The motion is linear between the six
// nodes of a face, which adds 0.2 % here; the flat faces of a straight mesh have less area.
TEST(Couplings, KnowTheAreaOfCurvedFaces) {
  const auto breathe = [](const Point& p) {
    return Eigen::Vector3d(p[0], p[1], p[2]).normalized();
  };
  const double exact = 2 * 4 * std::numbers::pi;  // omega is 2
  EXPECT_NEAR(CouplingOf(MakeTetSphere(1, 700, true), breathe) / exact, 1, 3e-3);
  EXPECT_LT(CouplingOf(MakeTetSphere(1, 700, false), breathe) / exact, 0.995);
}

// u = (0, 0, x - 0.5) moves air to and fro: the signed integral is zero, the coupling is not.
TEST(Couplings, CountBothSignsOfABendingMode) {
  const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, {3, 2, 2}, 4);
  EXPECT_NEAR(CouplingOf(mesh, [](const Point& p) { return Eigen::Vector3d(0, 0, p[0] - 0.5); }),
              2 * 2 * 0.6 * 0.25, 1e-12);
}

TEST(Couplings, OfABodyDoNotDependOnTheMesh) {
  const auto first_coupling = [](const std::array<int, 3>& cells) {
    const TetMesh mesh = MakeTetBox({1, 0.15, 0.1}, cells, 10);
    return Couplings(mesh, MakeSoundingSurface(mesh), ModesBelow(1.5, mesh).modes)[0];
  };
  // The coarse mesh has a third of the nodes; a sum over nodes would triple.
  EXPECT_NEAR(first_coupling({10, 2, 2}) / first_coupling({24, 3, 2}), 1, 0.01);
}

TEST(PoissonSlopes, AreTheDifferencesOfTwoDecompositions) {
  constexpr double kStep = 1e-3;
  const TetMesh free = MakeTetBox({1, 0.4, 0.3}, {4, 2, 2}, 10);
  TetMesh fixed = free;
  for (size_t n = 0; n < free.nodes.size(); ++n) {
    if (free.nodes[n][0] == 0) fixed.fixed.push_back(static_cast<int32_t>(n));
  }
  const auto at = [](double nu) { return ElasticConstants{.young_pa = 1, .poisson_ratio = nu}; };
  for (const double nu : {-0.3, 0.0, 0.19, 0.33}) {
    for (const TetMesh& mesh : {free, fixed}) {
      const Eigen::VectorXd slopes =
          PoissonSlopes(mesh, at(nu), ModesBelow(60, mesh, at(nu)).modes);
      const DeformationModes below = ModesBelow(60, mesh, at(nu - kStep));
      const DeformationModes above = ModesBelow(60, mesh, at(nu + kStep));
      ASSERT_GE(slopes.size(), 6);
      for (Eigen::Index m = 0; m < 6; ++m) {
        const double difference =
            std::log(above.modes.eigenvalues[m] / below.modes.eigenvalues[m]) / (2 * kStep);
        // The third derivative times kStep^2 / 6 is some 1e-5.
        EXPECT_NEAR(slopes[m], difference, 1e-4)
            << "mode " << m << ", ratio " << nu << (mesh.fixed.empty() ? "" : ", fixed");
      }
    }
  }
}

}  // namespace
}  // namespace carillon::precompute
