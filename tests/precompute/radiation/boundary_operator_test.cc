// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/boundary_operator.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "precompute/mesh/point_math.h"
#include "precompute/radiation/gmres.h"
#include "tests/precompute/radiation/spheres.h"

namespace carillon::precompute {
namespace {

using Complex = std::complex<double>;
using SparseMatrix = Eigen::SparseMatrix<double>;
constexpr double kFourPi = 4 * std::numbers::pi;

/// The left side of BoundaryOperator's equation as a matrix of complex numbers, assembled in double
/// without any of its kernels. `radius`: of a sphere around the surface.
class DenseEquation {
 public:
  DenseEquation(const AcousticSurface& surface, const NearCorrection& near, double k, double radius)
      : surface_(surface), near_(near), k_(k), eta_(0, 1 / std::max(k, 1 / radius)) {
    const auto n = static_cast<Eigen::Index>(surface.vertex_count());
    matrix_ = Eigen::MatrixXcd::Zero(n, n);
    AddMass();
    AddNear();
    AddLumped();
  }

  Eigen::MatrixXcd Take() && { return std::move(matrix_); }

 private:
  void AddMass() {
    for (size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
      const double weight = Norm(surface_.triangle_area_vectors[t]) / 24;
      for (const int32_t a : surface_.mesh.triangles[t]) {
        for (const int32_t b : surface_.mesh.triangles[t]) {
          matrix_(a, b) += weight * (a == b ? 2 : 1);
        }
      }
    }
  }

  void AddNear() {
    for (size_t v = 0; v < surface_.vertex_count(); ++v) {
      for (auto e = static_cast<size_t>(near_.row_begin[v]);
           e < static_cast<size_t>(near_.row_begin[v + 1]); ++e) {
        const NearEntry& entry = near_.entries[e];
        matrix_(static_cast<Eigen::Index>(v), near_.columns[e]) +=
            -static_cast<double>(entry.double_layer) +
            eta_ * (entry.curls - k_ * k_ * static_cast<double>(entry.single_layer));
      }
    }
  }

  void AddLumped() {
    const Eigen::Index n = matrix_.rows();
    Eigen::MatrixXcd green(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = 0; i < n; ++i) green(i, j) = AddPair(i, j);
    }
    for (const SparseMatrix& curl : CurlMatrices()) {
      const Eigen::MatrixXcd half = green * curl.cast<Complex>();
      matrix_ += eta_ * (curl.cast<Complex>().transpose() * half);
    }
  }

  /// Adds K and the normals' part of N, and returns G.
  Complex AddPair(Eigen::Index i, Eigen::Index j) {
    const auto a = static_cast<size_t>(i);
    const auto b = static_cast<size_t>(j);
    const Point e = Difference(surface_.mesh.vertices[b], surface_.mesh.vertices[a]);
    const double r = Norm(e);
    const Complex ik(0, k_);
    const Complex green = i == j ? ik / kFourPi : std::polar(1 / (kFourPi * r), k_ * r);
    if (i != j) {
      matrix_(i, j) -=
          surface_.areas[a] * Dot(surface_.area_vectors[b], e) / r * green * (ik - 1 / r);
    }
    matrix_(i, j) -=
        eta_ * k_ * k_ * Dot(surface_.area_vectors[a], surface_.area_vectors[b]) * green;
    return green;
  }

  /// For each component, the matrix from the values at the vertices to their lumped curls.
  std::array<SparseMatrix, 3> CurlMatrices() const {
    std::array<std::vector<Eigen::Triplet<double>>, 3> entries;
    for (size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
      const auto& corner = surface_.mesh.triangles[t];
      const double weight = Norm(surface_.triangle_area_vectors[t]) / 3;
      for (size_t c = 0; c < 3; ++c) {
        const Point hat = CurlOfHat(surface_, t, c);
        for (const int32_t at : corner) {
          for (size_t a = 0; a < 3; ++a) entries[a].emplace_back(at, corner[c], weight * hat[a]);
        }
      }
    }
    std::array<SparseMatrix, 3> curls;
    for (size_t a = 0; a < 3; ++a) {
      curls[a].resize(matrix_.rows(), matrix_.cols());
      curls[a].setFromTriplets(entries[a].begin(), entries[a].end());
    }
    return curls;
  }

  const AcousticSurface& surface_;
  const NearCorrection& near_;
  double k_;
  Complex eta_;
  Eigen::MatrixXcd matrix_;
};

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
  Eigen::MatrixXcd dense = DenseEquation(surface, near, GetParam(), 1).Take();
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
