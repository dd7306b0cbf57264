// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "precompute/mesh/fill/tetrahedralize.h"
#include "tests/physics/lamb_sphere.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.25};

/// Lowest modes of a sphere as eta = omega R / c_t. Its flat faces make the body smaller, so that R
/// is the radius of the ball of the same volume.
std::vector<double> Etas() {
  const absl::StatusOr<TetMesh> mesh =
      Tetrahedralize(MakeSphereSurface(1, 3), {.keep_surface = true, .target_node_count = 700});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  const double radius = std::cbrt(VolumeM3(*mesh) * 3 / (4 * std::numbers::pi));
  const double shear_speed = std::sqrt(ToLame(kElastic).mu_pa);
  std::vector<double> etas;
  for (const double hz : FrequenciesHz(ModesOf(*mesh, kElastic, 1, 0.285))) {
    etas.push_back(2 * std::numbers::pi * hz * radius / shear_speed);
  }
  return etas;
}

// Lamb: the five torsional modes of degree two are lowest, then the five spheroidal ones. The
// meshed ball is not round to 1 % of its radius.
TEST(Sphere, TenLowestModesAreThoseOfLamb) {
  const std::vector<double> etas = Etas();
  ASSERT_EQ(etas.size(), 10u);  // the next lies above the limit
  for (size_t m = 0; m < 5; ++m) EXPECT_NEAR(etas[m] / LowestTorsionalEta(), 1, 0.01) << m;
  for (size_t m = 5; m < 10; ++m) EXPECT_NEAR(etas[m] / LowestSpheroidalEta(0.25), 1, 0.01) << m;
}

// With sides that follow the sphere R is the sphere's own radius.
TEST(Sphere, CurvedElementsFindItsModesWithinATwentiethOfAPerCent) {
  const TetMesh mesh = MakeTetSphere(1, 700, true);
  EXPECT_LT(mesh.nodes.size(), 6500u);
  const double shear_speed = std::sqrt(ToLame(kElastic).mu_pa);
  const std::vector<double> hz = FrequenciesHz(ModesOf(mesh, kElastic, 1, 0.285));
  ASSERT_EQ(hz.size(), 10u);
  for (size_t m = 0; m < hz.size(); ++m) {
    const double eta = m < 5 ? LowestTorsionalEta() : LowestSpheroidalEta(0.25);
    EXPECT_NEAR(2 * std::numbers::pi * hz[m] / shear_speed / eta, 1, 5e-4) << m;
  }
}

// Tabulated by Lamb and many after him for a Poisson's ratio of 1/4: 0.7961 pi and 0.8403 pi.
TEST(Sphere, FrequencyEquationsHaveTheRootsTabulated) {
  EXPECT_NEAR(LowestTorsionalEta() / std::numbers::pi, 0.7961, 1e-4);
  EXPECT_NEAR(LowestSpheroidalEta(0.25) / std::numbers::pi, 0.8403, 1e-4);
}

}  // namespace
}  // namespace carillon::precompute
