// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/radiation/spheres.h"

#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <vector>

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

SurfaceMesh InFour(const SurfaceMesh& mesh) {
  SurfaceMesh finer{.vertices = mesh.vertices, .triangles = {}};
  std::map<std::pair<int32_t, int32_t>, int32_t> middles;
  const auto middle = [&](int32_t a, int32_t b) {
    const auto [found, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<int32_t>(finer.vertices.size()));
    if (is_new) {
      const Point p = mesh.vertices[static_cast<size_t>(a)],
                  q = mesh.vertices[static_cast<size_t>(b)];
      finer.vertices.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return found->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const std::array<int32_t, 3>& part : {std::array{a, ab, ca}, std::array{ab, b, bc},
                                               std::array{ca, bc, c}, std::array{ab, bc, ca}}) {
      finer.triangles.push_back(part);
    }
  }
  return finer;
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

std::pair<std::complex<double>, std::complex<double>> SphericalHankel(int l, double x) {
  const std::complex<double> i(0, 1);
  std::complex<double> before = -i * std::exp(i * x) / x;
  std::complex<double> value = -std::exp(i * x) * (x + i) / (x * x);
  if (l == 0) return {before, -value};
  for (int n = 1; n < l; ++n) {
    before = std::exchange(value, (2.0 * n + 1) / x * value - before);
  }
  return {value, before - (l + 1.0) / x * value};
}

double ExactPowerIntegral(int l, double wavenumber, double radius_m) {
  const auto slope = SphericalHankel(l, wavenumber * radius_m).second;
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
