// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/radiation/spheres.h"

#include <cmath>
#include <complex>
#include <numbers>

#include "precompute/mesh/point_math.h"
#include "precompute/radiation/spherical_harmonics.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

SurfaceMesh MakeIcosahedron() {
  const double g = std::numbers::phi;
  return {.vertices = {{-1, g, 0},
                       {1, g, 0},
                       {-1, -g, 0},
                       {1, -g, 0},
                       {0, -1, g},
                       {0, 1, g},
                       {0, -1, -g},
                       {0, 1, -g},
                       {g, 0, -1},
                       {g, 0, 1},
                       {-g, 0, -1},
                       {-g, 0, 1}},
          .triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                        {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                        {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                        {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}}};
}

void Scale(double factor, Point& p) {
  for (double& x : p) x *= factor;
}

}  // namespace

SurfaceMesh MakeIcosphere(double radius_m, int halvings) {
  SurfaceMesh sphere = MakeIcosahedron();
  for (int i = 0; i < halvings; ++i) sphere = InFour(sphere);
  for (Point& p : sphere.vertices) Scale(1 / Norm(p), p);
  const double blow = std::cbrt(4 * std::numbers::pi / 3 / EnclosedVolume(sphere));
  for (Point& p : sphere.vertices) Scale(blow * radius_m, p);
  return sphere;
}

std::vector<double> RealHarmonics(int order, const Point& direction) {
  const double theta = std::acos(direction[2] / Norm(direction));
  const double phi = std::atan2(direction[1], direction[0]);
  std::vector<double> harmonics;
  for (int l = 0; l <= order; ++l) {
    for (int m = -l; m <= l; ++m) {
      const auto degree = static_cast<unsigned>(std::abs(m));
      const double phase = m % 2 == 0 ? 1 : -1;  // the phase of Condon and Shortley
      const double turned = m < 0 ? std::sin(-m * phi) : std::cos(m * phi);
      harmonics.push_back((m == 0 ? 1 : std::numbers::sqrt2) * phase * turned *
                          std::sph_legendre(static_cast<unsigned>(l), degree, theta));
    }
  }
  return harmonics;
}

double ExactPowerIntegral(int l, double wavenumber, double radius_m) {
  const double x = wavenumber * radius_m;
  const auto hankel = [x](int n) {
    const auto order = static_cast<unsigned>(n);
    return std::complex<double>(std::sph_bessel(order, x), std::sph_neumann(order, x));
  };
  const std::complex<double> slope =
      l == 0 ? -hankel(1) : hankel(l - 1) - (l + 1.0) / x * hankel(l);
  return 1 / (std::pow(wavenumber, 4) * std::norm(slope));
}

Displacement HarmonicMotion(const SurfaceMesh& sphere, int l, int m) {
  Displacement displacement;
  for (const Point& p : sphere.vertices) {
    const double y = RealHarmonics(l, p)[HarmonicIndex(l, m)] / Norm(p);
    displacement.push_back(
        {static_cast<float>(y * p[0]), static_cast<float>(y * p[1]), static_cast<float>(y * p[2])});
  }
  return displacement;
}

}  // namespace carillon::precompute
