// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "precompute/mesh/fill/tetrahedralize.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

/// Lowest modes of a free elastic sphere (Lamb 1882) as eta = omega R / c_t, with c_t the speed of
/// shear waves.
double J(unsigned l, double x) { return std::sph_bessel(l, x); }

double TorsionalEquation(double eta) { return J(2, eta) - eta * J(3, eta); }

/// Stress-free surface: the determinant of radial and tangential stress (rows) of the potentials of
/// compression and of shear (columns), at degree l = 2.
double SpheroidalEquation(double eta, double poisson_ratio) {
  const double xi = eta * std::sqrt((1 - 2 * poisson_ratio) / (2 * (1 - poisson_ratio)));
  const double radial_compression = (2 - eta * eta / 2) * J(2, xi) + 2 * xi * J(3, xi);
  const double radial_shear = 6 * (J(2, eta) - eta * J(3, eta));
  const double tangential_compression = J(2, xi) - xi * J(3, xi);
  const double tangential_shear = (3 - eta * eta / 2) * J(2, eta) + eta * J(3, eta);
  return radial_compression * tangential_shear - radial_shear * tangential_compression;
}

/// The lowest root above `from`.
template <typename F>
double LowestRoot(F f, double from) {
  constexpr double kStep = 0.01;
  double low = from;
  while ((f(low) < 0) == (f(low + kStep) < 0)) low += kStep;
  double high = low + kStep;
  const bool sign = f(low) < 0;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    ((f(middle) < 0) == sign ? low : high) = middle;
  }
  return low;
}

/// The torsional mode of degree l = 2: root of (l - 1) j_l(eta) = eta j_{l+1}(eta).
double LowestTorsionalEta() { return LowestRoot(TorsionalEquation, 0.5); }

/// The spheroidal mode of degree l = 2 (the sphere becomes long and flat by turns).
double LowestSpheroidalEta(double poisson_ratio) {
  return LowestRoot([=](double eta) { return SpheroidalEquation(eta, poisson_ratio); }, 0.5);
}

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
