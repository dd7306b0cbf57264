// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <vector>

#include "precompute/mesh/point_math.h"
#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/solve_radiation.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

/// The tines of a tuning fork of 441 Hz: two bars along z that move apart and together along x, as
/// cantilevers clamped at z = 0 do.
struct Fork {
  static constexpr double kLengthM = 0.08;
  static constexpr double kWavenumber = 2 * std::numbers::pi * 441.3 / 343;

  SurfaceMesh mesh;
  Displacement motion;
};

/// A bar about the x axis with tines' thickness, turned to lie along z.
SurfaceMesh MakeTine() {
  constexpr double kThicknessM = 0.0055;
  SurfaceMesh tine = MakeRodSurface(kThicknessM / 2, Fork::kLengthM, 10, 40);
  for (Point& p : tine.vertices) p = {p[1], p[2], p[0]};
  return tine;
}

Fork MakeFork() {
  constexpr double kBetweenM = 0.018;  // middle to middle
  Fork fork;
  AddShell(fork.mesh, MakeTine(), {kBetweenM / 2, 0, 0});
  AddShell(fork.mesh, MakeTine(), {-kBetweenM / 2, 0, 0});
  for (const Point& p : fork.mesh.vertices) {
    const double up = std::pow(p[2] / Fork::kLengthM, 2);
    fork.motion.push_back({static_cast<float>(std::copysign(up, p[0])), 0, 0});
  }
  return fork;
}

/// The pressure of q = dp/dn and p on a surface at a place outside it, by the representation
/// formula and the vertex rule.
std::complex<double> PressureAt(const Point& place, const AcousticSurface& surface,
                                double wavenumber, std::span<const ComplexFloat> p,
                                const Displacement& motion) {
  std::complex<double> sum = 0;
  const std::complex<double> ik(0, wavenumber);
  for (size_t v = 0; v < surface.vertex_count(); ++v) {
    const Point e = Difference(surface.mesh.vertices[v], place);
    const double r = Norm(e);
    const std::complex<double> green = std::exp(ik * r) / (4 * std::numbers::pi * r);
    const Point& n = surface.area_vectors[v];
    const double q = n[0] * motion[v][0] + n[1] * motion[v][1] + n[2] * motion[v][2];
    sum += std::complex<double>(p[v]) * green * (ik - 1 / r) * (Dot(n, e) / r) - green * q;
  }
  return sum;
}

/// Levels in dB against the direction in which the tines move, each degree from 0 to 90, round the
/// tines at four fifths of their length.
std::vector<double> LevelsRoundFork(double distance_m) {
  const Fork fork = MakeFork();
  Workers workers(2);
  RemeshedSurface level;
  level.surface = MakeAcousticSurface(fork.mesh);
  level.near = MakeNearCorrection(level.surface, workers);
  RadiatingSurface body;
  body.center = {0, 0, Fork::kLengthM / 2};
  body.radius_m = 0.05;
  const SphereGrid grid(PatternOrder(Fork::kWavenumber, body.radius_m));
  const ModeField field = SolveRadiation({.wavenumber = Fork::kWavenumber,
                                          .displacements = {fork.motion},
                                          .starts = {},
                                          .tolerance = 1e-4},
                                         level, body, grid, workers)
                              .front();
  std::vector<double> levels;
  for (int degree = 0; degree <= 90; ++degree) {
    const double angle = degree * std::numbers::pi / 180;
    const Point place = {distance_m * std::cos(angle), distance_m * std::sin(angle),
                         0.8 * Fork::kLengthM};
    levels.push_back(20 * std::log10(std::abs(PressureAt(place, level.surface, Fork::kWavenumber,
                                                         field.pressure, fork.motion))));
  }
  for (size_t i = levels.size(); i-- > 0;) levels[i] -= levels[0];
  return levels;
}

// Near by, a tuning fork has four lobes: a linear quadrupole's (3 cos^2 - 1)/r^3 is zero at 54.7
// degrees (Russell, Am. J. Phys. 68, 2000).
TEST(Fork, HasFourLobesNearBy) {
  const std::vector<double> levels = LevelsRoundFork(0.05);
  const auto least = std::ranges::min_element(levels) - levels.begin();
  EXPECT_GE(least, 50);
  EXPECT_LE(least, 56);
  EXPECT_LT(levels[static_cast<size_t>(least)], -20);
  EXPECT_NEAR(levels[90], -6, 2);
}

// Far away it has two: cos^2.
TEST(Fork, HasTwoLobesFarAway) {
  const std::vector<double> levels = LevelsRoundFork(100);
  for (const size_t degree : {15U, 30U, 45U, 60U}) {
    const double cosine = std::cos(static_cast<double>(degree) * std::numbers::pi / 180);
    EXPECT_NEAR(levels[degree], 40 * std::log10(cosine), 1) << degree;
  }
  EXPECT_LT(levels[90], -20);
}

}  // namespace
}  // namespace carillon::precompute
