// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/boundary_operator.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <complex>
#include <cstddef>

#include "precompute/radiation/gmres.h"
#include "tests/precompute/radiation/dense_equation.h"
#include "tests/precompute/radiation/spheres.h"

namespace carillon::precompute {
namespace {

using Complex = std::complex<double>;

/// A squeezed sphere, so that nothing is symmetric.
SurfaceMesh MakeEgg() {
  SurfaceMesh egg = MakeIcosphere(1, 2);
  for (Point& p : egg.vertices) p = {p[0], 0.6 * p[1] + 0.2 * p[0], 0.8 * p[2] * (1 + 0.2 * p[0])};
  return egg;
}

std::vector<ComplexFloat> RandomPressure(Eigen::Index n, unsigned seed) {
  std::srand(seed);
  const Eigen::VectorXcf p = Eigen::VectorXcf::Random(n);
  return {p.data(), p.data() + n};
}

Eigen::VectorXcd ToEigen(const std::vector<ComplexFloat>& values) {
  return Eigen::VectorXcf::Map(values.data(), static_cast<Eigen::Index>(values.size()))
      .cast<Complex>();
}

struct BoundaryOperatorTest : ::testing::TestWithParam<double> {
  Workers workers{2};
  AcousticSurface surface = MakeAcousticSurface(MakeEgg());
  NearCorrection near = MakeNearCorrection(surface, workers);
  Eigen::MatrixXcd dense = AssembleDense(surface, near, GetParam(), 1);
  BoundaryOperator sweeps{surface, near, {0.1, 0, 0}, 1, GetParam()};
};

TEST_P(BoundaryOperatorTest, IsTheAssembledMatrixToSinglePrecision) {
  const std::vector<std::vector<ComplexFloat>> pressures = {RandomPressure(dense.rows(), 1),
                                                            RandomPressure(dense.rows(), 2)};
  for (const size_t sides : {1U, 2U}) {
    std::vector<std::vector<ComplexFloat>> results(sides);
    sweeps.Apply(std::span(pressures).first(sides), results, workers);
    for (size_t s = 0; s < sides; ++s) {
      const Eigen::VectorXcd exact = dense * ToEigen(pressures[s]);
      EXPECT_LT((ToEigen(results[s]) - exact).norm(), 1e-6 * exact.norm()) << "side " << s;
    }
  }
}

TEST_P(BoundaryOperatorTest, GmresFindsTheSolutionOfTheDenseFactorization) {
  const std::vector<Displacement> motion = {HarmonicMotion(surface.mesh, 2, 1)};
  const auto right_sides = sweeps.RightSides(motion, workers);
  const auto solution =
      SolveGmres([&](auto inputs, auto results) { sweeps.Apply(inputs, results, workers); },
                 sweeps.Diagonal(), right_sides, {}, {.tolerance = 2e-3});
  const Eigen::VectorXcd exact = dense.partialPivLu().solve(ToEigen(right_sides[0]));
  EXPECT_LT((ToEigen(solution[0].x) - exact).norm(), 0.01 * exact.norm());
  EXPECT_LT(solution[0].iterations, 20);
}

TEST_P(BoundaryOperatorTest, GmresStartsFromAGuess) {
  const std::vector<Displacement> motion = {HarmonicMotion(surface.mesh, 2, 1)};
  const auto right_sides = sweeps.RightSides(motion, workers);
  const auto apply = [&](auto inputs, auto results) { sweeps.Apply(inputs, results, workers); };
  const auto first = SolveGmres(apply, sweeps.Diagonal(), right_sides, {}, {});
  const std::vector<std::vector<ComplexFloat>> guess = {first[0].x};
  const auto again = SolveGmres(apply, sweeps.Diagonal(), right_sides, guess, {.tolerance = 1e-4});
  const auto anew = SolveGmres(apply, sweeps.Diagonal(), right_sides, {}, {.tolerance = 1e-4});
  EXPECT_LT(again[0].iterations, anew[0].iterations);
  EXPECT_LT((ToEigen(again[0].x) - ToEigen(anew[0].x)).norm(), 1e-3 * ToEigen(anew[0].x).norm());
}

INSTANTIATE_TEST_SUITE_P(Wavenumbers, BoundaryOperatorTest, ::testing::Values(0.3, 3.0, 9.0));

}  // namespace
}  // namespace carillon::precompute
