// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "precompute/eigen/block_basis.h"
#include "precompute/fem/assembly.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/multifrontal_inertia.h"
#include "precompute/sparse/ordered_system.h"
#include "precompute/sparse/tile_kernels.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kAluminium{.young_pa = 7e10, .poisson_ratio = 0.33};

SystemMatrices BoxSystem(int nodes_per_element, MassSharing sharing = MassSharing::kConsistent) {
  const TetMesh mesh = MakeTetBox({0.1, 0.03, 0.02}, {7, 3, 2}, nodes_per_element);
  return Assemble(mesh, kAluminium, 2700, sharing);
}

Eigen::MatrixXd Full(const SystemMatrices::Sparse& lower) {
  return Eigen::MatrixXd(lower).selfadjointView<Eigen::Lower>();
}

Eigen::VectorXd AllEigenvalues(const SystemMatrices& system) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      Full(system.K), Full(system.M), Eigen::EigenvaluesOnly);
  return solver.eigenvalues();
}

/// The relative residual of a solve with K + 1e8 M for sixteen random right-hand sides.
template <typename Real>
double SolveResidual(const SystemMatrices& system) {
  const double shift = -1e8;
  const OrderedSystem ordered = OrderedSystem::Make(system).value();
  Workers workers(2);
  const auto factor = MultifrontalCholesky<Real>::Factorize(ordered.fronts, ordered.matrix, shift,
                                                            workers, nullptr);
  const Eigen::Index rows = system.unknown_count();
  std::srand(1);
  const VectorBlock right = VectorBlock::Random(rows, kBlockWidth);
  VectorBlockOf<Real> x = right.cast<Real>();
  factor.value().Solve(x.data(), workers);
  const VectorBlock solution = x.template cast<double>();
  VectorBlock elastic(rows, kBlockWidth);
  VectorBlock inertial(rows, kBlockWidth);
  MultiplyStiffness(ordered.matrix, solution.data(), elastic.data());
  MultiplyMass(MakeMassRows<double>(ordered.matrix), workers, solution.data(), inertial.data());
  return (elastic - shift * inertial - right).norm() / right.norm();
}

TEST(Multifrontal, SolvesLinearAndQuadraticSystemsToThePrecisionOfItsNumbers) {
  // The condition number, about 1e7, times the rounding of a double.
  EXPECT_LT(SolveResidual<double>(BoxSystem(4)), 1e-9);
  EXPECT_LT(SolveResidual<double>(BoxSystem(10)), 1e-9);
  EXPECT_LT(SolveResidual<float>(BoxSystem(10)), 1e-1);
  EXPECT_GT(SolveResidual<float>(BoxSystem(10)), 1e-9);
}

TEST(Multifrontal, SolvesTwoBlocksAtOnceAsOneByOne) {
  const SystemMatrices system = BoxSystem(10);
  const OrderedSystem ordered = OrderedSystem::Make(system).value();
  Workers alone(1);
  const auto factor =
      MultifrontalCholesky<float>::Factorize(ordered.fronts, ordered.matrix, -1e8, alone, nullptr);
  std::srand(3);
  Eigen::Matrix<float, Eigen::Dynamic, kWideBlock, Eigen::RowMajor> wide;
  wide.setRandom(system.unknown_count(), kWideBlock);
  VectorBlockOf<float> first = wide.leftCols<kBlockWidth>();
  VectorBlockOf<float> second = wide.rightCols<kBlockWidth>();
  factor->SolveWide(wide.data());
  factor->Solve(first.data(), alone);
  factor->Solve(second.data(), alone);
  // The same products in the same order.
  EXPECT_LE((wide.leftCols<kBlockWidth>() - first).norm(), 1e-6 * first.norm());
  EXPECT_LE((wide.rightCols<kBlockWidth>() - second).norm(), 1e-6 * second.norm());
}

/// The unknowns of NodeMatrix from those of the user, multiplied by a power of D^1/2.
Eigen::MatrixXd Reordered(const OrderedSystem& ordered, const Eigen::MatrixXd& x, double power) {
  Eigen::MatrixXd y(x.rows(), x.cols());
  for (size_t i = 0; i < ordered.fronts.order.size(); ++i) {
    y.middleRows(3 * static_cast<Eigen::Index>(i), 3) =
        x.middleRows(3 * ordered.fronts.order[i], 3) * std::pow(ordered.matrix.root_mass[i], power);
  }
  return y;
}

TEST(Multifrontal, MultipliesLikeTheMatricesItWasMadeOf) {
  for (const MassSharing sharing : {MassSharing::kConsistent, MassSharing::kLumped}) {
    const SystemMatrices system = BoxSystem(10, sharing);
    const OrderedSystem ordered = OrderedSystem::Make(system).value();
    const Eigen::Index rows = system.unknown_count();
    std::srand(2);
    const Eigen::MatrixXd x = Eigen::MatrixXd::Random(rows, kBlockWidth);
    const VectorBlock scaled = Reordered(ordered, x, 1);
    VectorBlock y(rows, kBlockWidth);
    MultiplyStiffness(ordered.matrix, scaled.data(), y.data());
    const Eigen::MatrixXd stiffness_times_x = system.K.selfadjointView<Eigen::Lower>() * x;
    EXPECT_LT((y - Reordered(ordered, stiffness_times_x, -1)).norm(), 1e-12 * y.norm());
    EXPECT_EQ(ordered.matrix.mass_is_identity, sharing == MassSharing::kLumped);
    if (ordered.matrix.mass_is_identity) continue;
    Workers workers(2);
    MultiplyMass(MakeMassRows<double>(ordered.matrix), workers, scaled.data(), y.data());
    const Eigen::MatrixXd mass_times_x = system.M.selfadjointView<Eigen::Lower>() * x;
    EXPECT_LT((y - Reordered(ordered, mass_times_x, -1)).norm(), 1e-12 * y.norm());
  }
}

TEST(Multifrontal, RefusesAMatrixThatIsNotPositiveDefinite) {
  const OrderedSystem ordered = OrderedSystem::Make(BoxSystem(4)).value();
  Workers workers(2);
  const auto factor = MultifrontalCholesky<double>::Factorize(ordered.fronts, ordered.matrix, 1e10,
                                                              workers, nullptr);
  EXPECT_NE(factor.status().ToString().find("VERIFICATION_FAILED"), std::string::npos);
}

TEST(CountEigenvaluesBelow, AgreesWithAllEigenvaluesBetweenAnyTwo) {
  const SystemMatrices system = BoxSystem(4);
  const OrderedSystem ordered = OrderedSystem::Make(system).value();
  const Eigen::VectorXd all = AllEigenvalues(system);
  Workers workers(2);
  for (Eigen::Index i = 6; i + 1 < all.size(); i += 9) {
    if (all[i + 1] - all[i] < 1e-6 * all[i]) continue;
    const auto count = CountEigenvaluesBelow(ordered.fronts, ordered.matrix,
                                             (all[i] + all[i + 1]) / 2, workers, nullptr)
                           .value();
    EXPECT_EQ(count, i + 1);
  }
}

}  // namespace
}  // namespace carillon::precompute
