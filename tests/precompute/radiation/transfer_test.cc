// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/transfer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "precompute/mesh/point_math.h"
#include "precompute/radiation/spherical_harmonics.h"
#include "tests/precompute/radiation/spheres.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using Motion = std::function<Point(const Point&)>;

/// A body with made-up modes.
struct Body {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
  std::vector<double> eigenvalues;
  std::vector<float> shapes;

  SurfaceModes modes() const {
    return {
        .vertices = vertices, .triangles = triangles, .eigenvalues = eigenvalues, .shapes = shapes};
  }
};

/// `motions`: of each mode, at the vertices of `surface`; its wavenumber is that of the speed ratio
/// 1.
Body MakeBody(const SurfaceMesh& surface, const std::vector<double>& wavenumbers,
              const std::vector<Motion>& motions) {
  Body body{.vertices = {}, .triangles = surface.triangles, .eigenvalues = {}, .shapes = {}};
  for (const double k : wavenumbers) body.eigenvalues.push_back(k * k);
  for (const Point& p : surface.vertices) {
    body.vertices.push_back(
        {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    for (size_t a = 0; a < 3; ++a) {
      for (const Motion& motion : motions) body.shapes.push_back(static_cast<float>(motion(p)[a]));
    }
  }
  return body;
}

/// An ellipsoid of half axes 1, 0.6 and 0.8.
SurfaceMesh MakeEllipsoid() {
  SurfaceMesh surface = MakeIcosphere(1, 4);
  for (Point& p : surface.vertices) p = {p[0], 0.6 * p[1], 0.8 * p[2]};
  return surface;
}

Point Bending(const Point& p) { return {-p[0] * p[1], p[0] * p[0] - 0.3, 0.2 * p[2]}; }
Point Twisting(const Point& p) { return {p[1], p[0] * p[2], -p[0] * p[1]}; }

RadiationSettings Settings(double goal_db = 2) {
  return {.speed_ratio = 1,
          .air = {},
          .least_wavenumber = 0.01,
          .greatest_wavenumber = 100,
          .goal_db = goal_db,
          .budget_cpu_s = 0,
          .thread_count = 2};
}

Transfer Compute(const Body& body, const RadiationSettings& settings) {
  absl::StatusOr<Transfer> transfer = ComputeTransfer(body.modes(), settings, [](double) {});
  EXPECT_TRUE(transfer.ok()) << transfer.status();
  return *std::move(transfer);
}

double Decibels(double ratio) { return 10 * std::log10(ratio); }

// P = -a^2 exp(-i k a)/(1 - i k a): the decay is rho0 c k^2 4 pi a^4 / (1 + k^2 a^2) / 2.
TEST(Transfer, BreathingSphereDecaysAsTheClosedFormSays) {
  const Body body =
      MakeBody(MakeIcosphere(1, 4), {0.5, 4}, std::vector<Motion>(2, [](const Point& p) {
                 const double r = Norm(p);
                 return Point{p[0] / r, p[1] / r, p[2] / r};
               }));
  const Transfer transfer = Compute(body, Settings(0.5));
  for (const ModeRadiation& mode : transfer.modes) {
    const double k = mode.wavenumber;
    const double exact = 1.204 * 343 * k * k * 4 * std::numbers::pi / (1 + k * k) / 2;
    EXPECT_NEAR(mode.DecayRatePerS(transfer.settings.air) / exact, 1, 0.03) << k;
    EXPECT_EQ(mode.order, 0);
  }
}

/// The stated error in direction of a sphere that moves by the harmonic (1, 0) and by each of order
/// 3 with `share` of its amplitude.
double StatedDirectionErrorDb(double share) {
  const auto motion = [share](const Point& p) {
    const std::vector<double> harmonics = RealHarmonics(3, p);
    double amplitude = harmonics[HarmonicIndex(1, 0)];
    for (int m = -3; m <= 3; ++m) amplitude += share * harmonics[HarmonicIndex(3, m)];
    const double r = Norm(p);
    return Point{amplitude * p[0] / r, amplitude * p[1] / r, amplitude * p[2] / r};
  };
  const Body body = MakeBody(MakeIcosphere(1, 4), {3}, {motion});
  return Compute(body, Settings(0.5)).modes[0].direction_error_db;
}

TEST(Transfer, StatedErrorOfDirectionsCountsTheHarmonicsThatAreLeftOut) {
  EXPECT_GT(StatedDirectionErrorDb(0.008), StatedDirectionErrorDb(0) + 0.1);
}

TEST(Transfer, IsTheSameWhereverTheBodyIsAndHoweverItIsTurned) {
  const auto turned = [](const Point& p) { return Point{-p[1], p[2], -p[0]}; };
  SurfaceMesh moved = MakeEllipsoid();
  for (Point& p : moved.vertices) {
    p = turned(p);
    p[0] += 3, p[2] -= 2;
  }
  const auto motion = [&](Point p) {
    p[0] -= 3, p[2] += 2;
    return turned(Bending({-p[2], -p[0], p[1]}));
  };
  const ModeRadiation here =
      Compute(MakeBody(MakeEllipsoid(), {3}, {Bending}), Settings(0.5)).modes[0];
  const ModeRadiation there = Compute(MakeBody(moved, {3}, {motion}), Settings(0.5)).modes[0];
  EXPECT_NEAR(Decibels(here.power_integral / there.power_integral), 0, 0.1);
  EXPECT_NEAR(here.normal_energy, there.normal_energy, 1e-4 * here.normal_energy);
}

// A body g times as large of unit density has phi' = phi g^-1.5 and Lambda' = Lambda / g^2.
TEST(Transfer, ScalesWithTheSizeOfTheBody) {
  const double g = 0.05;
  SurfaceMesh small = MakeEllipsoid();
  for (Point& p : small.vertices) p = {g * p[0], g * p[1], g * p[2]};
  const auto motion = [&](const Point& p) {
    const Point u = Bending({p[0] / g, p[1] / g, p[2] / g});
    const double scale = std::pow(g, -1.5);
    return Point{scale * u[0], scale * u[1], scale * u[2]};
  };
  const Transfer whole = Compute(MakeBody(MakeEllipsoid(), {3}, {Bending}), Settings());
  const Transfer part = Compute(MakeBody(small, {3 / g}, {motion}), Settings());
  EXPECT_NEAR(part.modes[0].power_integral / (whole.modes[0].power_integral * g), 1, 1e-3);
  EXPECT_NEAR(part.modes[0].DecayRatePerS({}) * g / whole.modes[0].DecayRatePerS({}), 1, 1e-3);
  EXPECT_NEAR(part.modes[0].efficiency() / whole.modes[0].efficiency(), 1, 1e-3);
}

// The wall of the void moves a hundred times as much as the outside.
TEST(Transfer, CountsNothingOfAnEnclosedVoid) {
  SurfaceMesh hollow = MakeEllipsoid();
  AddShell(hollow, InsideOut(MakeIcosphere(0.4, 3)));
  AddShell(hollow, MakeIcosphere(0.1, 2));  // a ball loose within
  const auto motion = [](const Point& p) {
    Point u = Bending(p);
    if (Norm(p) < 0.5) u = {100 * p[0], 100 * p[1], 100 * p[2]};
    return u;
  };
  const Transfer solid = Compute(MakeBody(MakeEllipsoid(), {3}, {Bending}), Settings());
  const Transfer with_void = Compute(MakeBody(hollow, {3}, {motion}), Settings());
  EXPECT_NEAR(Decibels(solid.modes[0].power_integral / with_void.modes[0].power_integral), 0, 0.01);
}

TEST(Transfer, SolvesTheTwoModesOfAPairEachAsAlone) {
  const Body pair = MakeBody(MakeEllipsoid(), {3, 3.003}, {Bending, Twisting});
  const Transfer both = Compute(pair, Settings(0.5));
  const Transfer second = Compute(MakeBody(MakeEllipsoid(), {3.003}, {Twisting}), Settings(0.5));
  EXPECT_NEAR(Decibels(both.modes[1].power_integral / second.modes[0].power_integral), 0, 0.05);
}

TEST(Transfer, StatedErrorsHoldAgainstTheClosedForm) {
  const auto zonal = [](int l) {
    return [l](const Point& p) {
      const double y = std::legendre(static_cast<unsigned>(l), p[2] / Norm(p)) *
                       std::sqrt((2 * l + 1) / (4 * std::numbers::pi)) / Norm(p);
      return Point{y * p[0], y * p[1], y * p[2]};
    };
  };
  const Transfer transfer =
      Compute(MakeBody(MakeIcosphere(1, 4), {3, 6, 9}, {zonal(1), zonal(2), zonal(4)}), Settings());
  for (size_t m = 0; m < 3; ++m) {
    const ModeRadiation& mode = transfer.modes[m];
    const double exact = ExactPowerIntegral(std::array{1, 2, 4}[m], mode.wavenumber, 1);
    EXPECT_LE(mode.power_error_db, 2);
    EXPECT_LT(std::abs(Decibels(mode.power_integral / exact)), 1.5 * mode.power_error_db);
  }
}

TEST(Transfer, LeavesOutModesBeyondTheBand) {
  RadiationSettings settings = Settings();
  settings.greatest_wavenumber = 3.5;
  const Transfer transfer =
      Compute(MakeBody(MakeEllipsoid(), {3, 4}, {Bending, Twisting}), settings);
  EXPECT_TRUE(transfer.modes[0].computed);
  EXPECT_FALSE(transfer.modes[1].computed);
}

}  // namespace
}  // namespace carillon::precompute
