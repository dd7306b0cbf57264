// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/assembly.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCore>

#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kElastic{.young_pa = 3, .poisson_ratio = 0.3};
constexpr double kDensity = 2;
constexpr Point kSize{1.0, 0.7, 0.4};

struct AssemblyTest : ::testing::TestWithParam<int> {
  TetMesh mesh = MakeTetBox(kSize, {3, 2, 2}, GetParam());

  SystemMatrices System(MassSharing sharing = MassSharing::kConsistent) const {
    return Assemble(mesh, kElastic, kDensity, sharing);
  }

  /// Displacement A x + b at each node.
  Eigen::VectorXd Affine(const Eigen::Matrix3d& A, const Eigen::Vector3d& b) const {
    Eigen::VectorXd u(3 * static_cast<Eigen::Index>(mesh.nodes.size()));
    for (size_t i = 0; i < mesh.nodes.size(); ++i) {
      u.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          A * Eigen::Vector3d(mesh.nodes[i].data()) + b;
    }
    return u;
  }

  bool OnBoundary(size_t node) const {
    const Point& p = mesh.nodes[node];
    for (size_t a = 0; a < 3; ++a) {
      if (p[a] < 1e-9 || p[a] > kSize[a] - 1e-9) return true;
    }
    return false;
  }
};

// The patch test: a body strained uniformly is in balance, wherever no face is loaded.
TEST_P(AssemblyTest, UniformStrainLeavesNoForceInside) {
  const Eigen::Matrix3d gradient{{0.3, -0.7, 0.2}, {0.5, 0.1, 0.9}, {-0.4, 0.6, -0.8}};
  const Eigen::VectorXd force =
      System().K.selfadjointView<Eigen::Lower>() * Affine(gradient, {1, 2, 3});
  int inside = 0;
  for (size_t i = 0; i < mesh.nodes.size(); ++i) {
    if (OnBoundary(i)) continue;
    ++inside;
    EXPECT_NEAR(force.segment<3>(3 * static_cast<Eigen::Index>(i)).norm(), 0, 1e-13);
  }
  EXPECT_GT(inside, 0);
}

TEST_P(AssemblyTest, EnergyOfUniformStrainIsVolumeTimesItsDensity) {
  const Eigen::Matrix3d stretch = Eigen::Vector3d(0.1, 0, 0).asDiagonal();
  const Eigen::VectorXd u = Affine(stretch, {0, 0, 0});
  const auto [lambda, mu] = ToLame(kElastic);
  EXPECT_NEAR(VolumeM3(mesh), 0.28, 1e-15);
  EXPECT_NEAR(u.dot(System().K.selfadjointView<Eigen::Lower>() * u) / 2,
              0.28 * (lambda / 2 + mu) * 0.01, 1e-14);
}

TEST_P(AssemblyTest, MassOfATranslationIsThatOfTheBody) {
  const Eigen::VectorXd u = Affine(Eigen::Matrix3d::Zero(), {0, 1, 0});
  for (const MassSharing sharing : {MassSharing::kConsistent, MassSharing::kLumped}) {
    const SystemMatrices system = System(sharing);
    EXPECT_NEAR(u.dot(system.M.selfadjointView<Eigen::Lower>() * u), kDensity * 0.28, 1e-14);
  }
}

INSTANTIATE_TEST_SUITE_P(NodesPerElement, AssemblyTest, ::testing::Values(4, 10));

}  // namespace
}  // namespace carillon::precompute
