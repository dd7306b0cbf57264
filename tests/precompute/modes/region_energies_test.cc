// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/region_energies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/boundary.h"
#include "precompute/modes/deformation_modes.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::DoubleNear;
using ::testing::Pointwise;

// A rod of two materials along x. Without Poisson's ratio a cross section stays plane and does not
// shrink, so that the theory of longitudinal waves is exact.
constexpr double kLength = 1;
constexpr double kJoint = 0.375;
const BodyMaterials kMaterials({{"stiff", {.young_pa = 8, .poisson_ratio = 0}, 3},
                                {"soft", {.young_pa = 1, .poisson_ratio = 0}, 0.5}});

/// The displacement u = cos(k1 x) left of the joint and b cos(k2 (L - x)) right of it, with
/// omega = k sqrt(E/rho) in both, is free of stress at the ends.
struct RodMode {
  explicit RodMode(double omega)
      : k1(omega * std::sqrt(3.0 / 8)),
        k2(omega * std::sqrt(0.5 / 1)),
        b(std::cos(k1 * kJoint) / std::cos(k2 * (kLength - kJoint))) {}

  /// The force left of the joint minus that right of it; zero for a mode.
  double ForceJump() const {
    return -8 * k1 * std::sin(k1 * kJoint) - b * k2 * std::sin(k2 * (kLength - kJoint));
  }
  double At(double x) const {
    return x < kJoint ? std::cos(k1 * x) : b * std::cos(k2 * (kLength - x));
  }
  /// The part of the strain energy left of the joint: the integral of E u'^2.
  double StrainOfFirst() const {
    const auto squares = [](double k, double length) {
      return k * k * (length / 2 - std::sin(2 * k * length) / (4 * k));
    };
    const double first = 8 * squares(k1, kJoint);
    return first / (first + b * b * squares(k2, kLength - kJoint));
  }
  /// The part of the kinetic energy left of the joint: the integral of rho u^2.
  double KineticOfFirst() const {
    const auto squares = [](double k, double length) {
      return length / 2 + std::sin(2 * k * length) / (4 * k);
    };
    const double first = 3 * squares(k1, kJoint);
    return first / (first + 0.5 * b * b * squares(k2, kLength - kJoint));
  }

  double k1, k2, b;
};

/// The first angular frequencies of the rod, by bisection between poles of the force.
std::vector<double> RodFrequencies(size_t count) {
  std::vector<double> found;
  constexpr double kStep = 1e-3;
  for (double omega = kStep; found.size() < count; omega += kStep) {
    double low = omega, high = omega + kStep;
    const double at_low = RodMode(low).ForceJump(), at_high = RodMode(high).ForceJump();
    if (at_low * at_high > 0 || std::abs(at_low - at_high) > 10) continue;  // no root, or a pole
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (RodMode(middle).ForceJump() * at_low > 0 ? low : high) = middle;
    }
    found.push_back(low);
  }
  return found;
}

TetMesh Rod() {
  TetMesh mesh = MakeTetBox({kLength, 0.1, 0.1}, {24, 2, 2}, 10);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    double x = 0;
    for (size_t i = 0; i < 4; ++i) {
      x += mesh.nodes[static_cast<size_t>(mesh.elements[10 * e + i])][0] / 4;
    }
    mesh.regions.push_back(x < kJoint ? 0 : 1);
  }
  return mesh;
}

/// How well a mode's motion along x is that of the rod, from 0 to 1.
double Likeness(const RodMode& rod, const TetMesh& mesh, const Eigen::VectorXd& shape) {
  double product = 0, of_shape = 0, of_rod = 0;
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const double u = rod.At(mesh.nodes[n][0]);
    product += u * shape[static_cast<Eigen::Index>(3 * n)];
    of_rod += u * u;
  }
  of_shape = shape.squaredNorm();
  return product * product / (of_shape * of_rod);
}

TEST(RegionEnergies, ARodOfTwoMaterialsHasTheFrequenciesAndEnergiesOfTheory) {
  const TetMesh mesh = Rod();
  const std::vector<double> omegas = RodFrequencies(3);
  const DeformationModes solution =
      SolveDeformationModes(Assemble(mesh, kMaterials, MassSharing::kConsistent), mesh.nodes,
                            1.1 * omegas.back() * omegas.back(), [](SolveStage, double) {})
          .value();
  const std::vector<ModelRegion> regions = RegionEnergies(mesh, kMaterials, solution.modes);
  ASSERT_EQ(regions.size(), 2U);
  EXPECT_EQ(regions[1].material.region, "soft");
  for (size_t m = 0; m < regions[0].strain_parts.size(); ++m) {
    EXPECT_NEAR(regions[0].strain_parts[m] + regions[1].strain_parts[m], 1, 1e-12);
    EXPECT_NEAR(regions[0].kinetic_parts[m] + regions[1].kinetic_parts[m], 1, 1e-12);
  }
  for (const double omega : omegas) {
    const RodMode rod(omega);
    Eigen::Index best = 0;
    for (Eigen::Index m = 0; m < solution.modes.shapes.cols(); ++m) {
      const auto likeness = [&](Eigen::Index i) {
        return Likeness(rod, mesh, solution.modes.shapes.col(i));
      };
      if (likeness(m) > likeness(best)) best = m;
    }
    const auto m = static_cast<size_t>(best);
    EXPECT_NEAR(std::sqrt(solution.modes.eigenvalues[best]) / omega, 1, 1e-4) << omega;
    EXPECT_NEAR(regions[0].strain_parts[m], rod.StrainOfFirst(), 1e-3) << omega;
    EXPECT_NEAR(regions[0].kinetic_parts[m], rod.KineticOfFirst(), 1e-3) << omega;
  }
}

TEST(RegionEnergies, EachTriangleBoundsTheRegionOfItsElement) {
  const TetMesh mesh = Rod();
  const SurfaceMesh given = BoundarySurface(mesh);
  const std::vector<uint8_t> regions = GivenTriangleRegions(mesh, given);
  ASSERT_EQ(regions.size(), given.triangles.size());
  for (size_t t = 0; t < regions.size(); ++t) {
    double x = 0;
    for (const int32_t v : given.triangles[t]) x += given.vertices[static_cast<size_t>(v)][0] / 3;
    EXPECT_EQ(regions[t], x < kJoint ? 0 : 1) << t;
  }
}

TEST(MassMoments, AreThoseOfTheTwoBoxesOfTheRod) {
  const double first = 3 * kJoint * 0.01, second = 0.5 * (kLength - kJoint) * 0.01;
  const double x1 = kJoint / 2, x2 = (kLength + kJoint) / 2;
  const auto square = [](double middle, double length) {
    return middle * middle + length * length / 12;
  };
  const double mass = first + second, across = mass * 0.01 / 3;
  const double along = first * square(x1, kJoint) + second * square(x2, kLength - kJoint);
  const double middle = first * x1 + second * x2;
  EXPECT_THAT(MassMoments(Rod(), kMaterials),
              Pointwise(DoubleNear(1e-12),
                        std::vector{mass, middle, mass * 0.05, mass * 0.05, along, across, across,
                                    middle * 0.05, mass * 0.0025, middle * 0.05}));
}

}  // namespace
}  // namespace carillon::precompute
