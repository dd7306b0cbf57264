// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/rigid_radiation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "precompute/radiation/spherical_harmonics.h"
#include "tests/precompute/radiation/spheres.h"

namespace carillon::precompute {
namespace {

constexpr double kPi = std::numbers::pi;

MassProperties MassOf(const SurfaceMesh& mesh) {
  std::vector<std::array<float, 3>> vertices;
  for (const auto& [x, y, z] : mesh.vertices) {
    vertices.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  }
  return ComputeMassProperties(vertices, mesh.triangles);
}

RigidRadiation Solve(const SurfaceMesh& mesh) {
  Workers workers(2);
  RemeshedSurface level;
  level.surface = MakeAcousticSurface(mesh);
  level.near = MakeNearCorrection(level.surface, workers);
  RadiatingSurface body;
  body.radius_m = 1;
  return SolveRigidMotions(MassOf(mesh), level, body, RigidWavenumbers(level, 8), workers);
}

TEST(MassProperties, OfAnEllipsoidAreThoseOfTheClosedForm) {
  SurfaceMesh mesh = MakeIcosphere(1, 4);
  for (Point& p : mesh.vertices) p = {p[0] + 3, 0.6 * p[1], 0.8 * p[2] - 1};
  const MassProperties mass = MassOf(mesh);
  const double volume = 4 * kPi / 3 * 0.48;
  EXPECT_NEAR(mass.volume_m3, volume, 1e-5 * volume);
  EXPECT_NEAR(mass.center_of_mass[0], 3, 1e-5);
  EXPECT_NEAR(mass.center_of_mass[2], -1, 1e-5);
  EXPECT_NEAR(mass.inertia[0], volume / 5 * (0.36 + 0.64), 0.01 * volume);
  EXPECT_NEAR(mass.inertia[1], volume / 5 * (1 + 0.64), 0.01 * volume);
  EXPECT_NEAR(mass.inertia[2], volume / 5 * (1 + 0.36), 0.01 * volume);
  for (size_t i = 3; i < 6; ++i) EXPECT_NEAR(mass.inertia[i], 0, 1e-4 * volume);
}

// The axes lie on a diagonal: x = y moves more mass than x = -y.
TEST(MassProperties, ProductsOfInertiaAreNegativeIntegrals) {
  SurfaceMesh mesh = MakeIcosphere(1, 3);
  for (Point& p : mesh.vertices) p = {p[0] + 0.5 * p[1], p[1], p[2]};
  // The integral of x y is 0.5 that of y^2, which is V/5.
  const MassProperties mass = MassOf(mesh);
  EXPECT_NEAR(mass.inertia[3], -0.1 * mass.volume_m3, 0.01 * mass.volume_m3);
}

// A sphere in translation is its own equivalent sphere: I = (4 pi / 3) / (k^4 |h_1'(k a)|^2).
TEST(RigidMotions, OfASphereAreThoseOfTheClosedForm) {
  const RigidRadiation rigid = Solve(MakeIcosphere(1, 3));
  const double n_in_harmonics = std::sqrt(4 * kPi / 3);
  for (size_t motion = 0; motion < 3; ++motion) {
    const RigidRadiation::Motion& found = rigid.motions[motion];
    for (size_t w = 0; w < rigid.wavenumbers.size(); ++w) {
      const double k = rigid.wavenumbers[w];
      const double exact = 4 * kPi / 3 * ExactPowerIntegral(1, k, 1);
      EXPECT_NEAR(10 * std::log10(found.power_integrals[w] / exact), 0, 0.2) << "k " << k;
    }
    EXPECT_NEAR(found.radius_m, 1, 0.03);
    const int m = std::array{1, -1, 0}[motion];
    for (size_t i = 0; i < kRigidHarmonicCount; ++i) {
      const double expected = i == HarmonicIndex(1, m) ? n_in_harmonics : 0;
      EXPECT_NEAR(found.strengths[i], expected, 0.05 * n_in_harmonics) << "harmonic " << i;
    }
    EXPECT_LT(found.error_db, 0.2);
  }
  // Its rotation moves no air.
  for (size_t motion = 3; motion < 6; ++motion) {
    for (size_t w = 0; w < rigid.wavenumbers.size(); ++w) {
      EXPECT_LT(rigid.motions[motion].power_integrals[w],
                1e-4 * rigid.motions[0].power_integrals[w]);
    }
  }
}

// At low frequency a translating spheroid is a dipole of its volume and its added mass: c_10 =
// i k^2 (V + M / rho0) sqrt(4 pi / 3) / (4 pi). Lamb's coefficient of a disc-like spheroid of axes
// 1 and 1/2 is M = 1.118 rho0 V along its axis and 0.310 rho0 V across it (Lamb, Hydrodynamics,
// 114).
TEST(RigidMotions, OfASpheroidHaveItsAddedMass) {
  SurfaceMesh mesh = MakeIcosphere(1, 3);
  for (Point& p : mesh.vertices) p[2] *= 0.5;
  const RigidRadiation rigid = Solve(mesh);
  const double k = rigid.wavenumbers.front();
  for (const auto& [motion, added] : {std::pair{2U, 1.118}, std::pair{0U, 0.310}}) {
    const double dipole = (1 + added) * rigid.mass.volume_m3 * k / (4 * kPi);
    EXPECT_NEAR(rigid.motions[motion].power_integrals[0] / (4 * kPi / 3 * dipole * dipole), 1, 0.06)
        << "motion " << motion;
    EXPECT_LT(rigid.motions[motion].error_db, 2);
  }
}

}  // namespace
}  // namespace carillon::precompute
