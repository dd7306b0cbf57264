// SPDX-License-Identifier: Apache-2.0
//
// Bars that are free, or fixed at one end: each family of modes, told apart by its shapes, against
// its closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/fix_nodes.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

/// A straight uniform beam of steel.
struct FreeBeam {
  double length_m;
  double area_m2;
  double second_moment_m4;
  double shear_coefficient;  ///< kappa
};

double FrequencyEquation(const FreeBeam& beam, double omega) {
  const double shear = beam.shear_coefficient * kSteel.young_pa / (2 * (1 + kSteel.poisson_ratio));
  const double inertia = kSteelDensity * omega * omega;
  const double p = inertia / kSteel.young_pa * (1 + kSteel.young_pa / shear);
  const double r = inertia * beam.area_m2 / (kSteel.young_pa * beam.second_moment_m4) -
                   inertia * inertia / (kSteel.young_pa * shear);
  const double root = std::sqrt(p * p + 4 * r);
  const double alpha = std::sqrt((root - p) / 2);
  const double beta = std::sqrt((root + p) / 2);
  const double q = inertia / shear;
  const double half = beam.length_m / 2;
  return (alpha * alpha + q) * std::tan(beta * half) / beta +
         (beta * beta - q) * std::tanh(alpha * half) / alpha;
}

/// Frequency of the lowest bending mode by Timoshenko's theory, Hz: shear and rotary inertia
/// included, from its full frequency equation for modes even about the middle,
///
///     (alpha^2 + q) tan(beta L/2) / beta + (beta^2 - q) tanh(alpha L/2) / alpha = 0,
///
/// with q = rho w^2 / (kappa G), and s = alpha, i beta the roots of
/// s^4 + rho w^2/E (1 + E/(kappa G)) s^2 - rho A w^2/(E I) + rho^2 w^4/(E kappa G) = 0.
double FirstBendingHz(const FreeBeam& beam) {
  // Euler's value, (4.73004 / L)^2 sqrt(EI / (rho A)), is an upper bound; the pole of tan at
  // beta L = pi lies far below.
  const double euler =
      std::pow(4.730040744862704 / beam.length_m, 2) *
      std::sqrt(kSteel.young_pa * beam.second_moment_m4 / (kSteelDensity * beam.area_m2));
  double low = 0.6 * euler;
  double high = euler;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (FrequencyEquation(beam, middle) < 0 ? low : high) = middle;
  }
  return low / (2 * std::numbers::pi);
}

/// Frequency of the `order`-th (from 1) bending mode of a beam clamped at one end, free at the
/// other, by Timoshenko's theory, Hz: the root of Huang's frequency equation (J. Appl. Mech. 28,
/// 1961) with b^2 = rho A L^4 w^2 / (E I), r^2 = I / (A L^2), s^2 = E I / (kappa A G L^2); for a
/// slender beam Euler's cosh(beta L) cos(beta L) = -1.
double ClampedBendingHz(const FreeBeam& beam, int order) {
  const double bending = kSteel.young_pa * beam.second_moment_m4;
  const double shear =
      beam.shear_coefficient * beam.area_m2 * kSteel.young_pa / (2 * (1 + kSteel.poisson_ratio));
  const double r2 = beam.second_moment_m4 / (beam.area_m2 * beam.length_m * beam.length_m);
  const double s2 = bending / (shear * beam.length_m * beam.length_m);
  // Below the frequency at which shear alone resonates, so that all is real.
  const auto equation = [&](double b) {
    const double root = std::sqrt((r2 - s2) * (r2 - s2) + 4 / (b * b));
    const double alpha = std::sqrt((root - r2 - s2) / 2);
    const double beta = std::sqrt((root + r2 + s2) / 2);
    return 2 + (b * b * (r2 - s2) * (r2 - s2) + 2) * std::cosh(b * alpha) * std::cos(b * beta) -
           b * (r2 + s2) / std::sqrt(1 - b * b * r2 * s2) * std::sinh(b * alpha) *
               std::sin(b * beta);
  };
  constexpr double kStep = 0.01;  // far below the distance of two roots
  double b = kStep;
  for (int found = 0; found < order; b += kStep) {
    if (equation(b) * equation(b + kStep) <= 0) ++found;
  }
  double low = b - kStep;
  double high = b;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (equation(low) * equation(middle) <= 0 ? high : low) = middle;
  }
  return low / (2 * std::numbers::pi) * std::sqrt(bending / (kSteelDensity * beam.area_m2)) /
         (beam.length_m * beam.length_m);
}

/// A rectangular bar bending in its plane of `height_m`; kappa by Cowper 1966: 10(1+nu)/(12+11nu).
FreeBeam RectangularBeam(double length_m, double height_m, double width_m) {
  return {.length_m = length_m,
          .area_m2 = height_m * width_m,
          .second_moment_m4 = width_m * std::pow(height_m, 3) / 12,
          .shear_coefficient = 10 * (1 + kSteel.poisson_ratio) / (12 + 11 * kSteel.poisson_ratio)};
}

/// How a bar along the x axis moves, told from the shape of the mode.
enum class Family { kLongitudinal, kTorsional, kBending };

/// Which motion of its cross-sections a mode is most of: along the axis, about it, or across it.
/// Each cross-section of nodes with one x gives its mean displacement and its mean rotation about
/// the axis, which goes through (y, z).
Family FamilyOf(const TetMesh& mesh, const Eigen::VectorXd& shape, double y, double z) {
  struct Section {
    double count = 0, r2 = 0, moment = 0;
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
  };
  std::map<int64_t, Section> sections;
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Point& p = mesh.nodes[n];
    const auto u = shape.segment<3>(3 * static_cast<Eigen::Index>(n));
    const double dy = p[1] - y;
    const double dz = p[2] - z;
    Section& section = sections[std::llround(p[0] * 1e6)];
    section.count += 1;
    section.r2 += dy * dy + dz * dz;
    section.moment += dy * u[2] - dz * u[1];
    section.u += u;
  }
  double along = 0, about = 0, across = 0;
  for (const auto& [x, section] : sections) {
    along += section.u[0] * section.u[0] / section.count;
    across += section.u.tail<2>().squaredNorm() / section.count;
    about += section.moment * section.moment / section.r2;
  }
  if (along > about && along > across) return Family::kLongitudinal;
  return about > across ? Family::kTorsional : Family::kBending;
}

/// A bar whose axis goes through (y, z), and its modes.
struct BarModes {
  TetMesh mesh;
  DeformationModes modes;
  double y = 0, z = 0;

  /// Natural frequencies of one family, Hz, ascending.
  std::vector<double> Of(Family family) const {
    std::vector<double> result;
    const std::vector<double> all = FrequenciesHz(modes);
    for (size_t m = 0; m < all.size(); ++m) {
      const auto column = static_cast<Eigen::Index>(m);
      if (FamilyOf(mesh, modes.modes.shapes.col(column), y, z) == family) result.push_back(all[m]);
    }
    return result;
  }
};

constexpr double kLength = 0.3;
constexpr double kSide = 0.02;  // the side of the square section

/// The n-th longitudinal mode, Hz, lowered by the inertia of the section's breathing (Rayleigh and
/// Love).
double LongitudinalHz(int n, double polar_radius2_m2) {
  const double speed = std::sqrt(kSteel.young_pa / kSteelDensity);
  const double k = n * std::numbers::pi / kLength;
  const double nu = kSteel.poisson_ratio;
  return n * speed / (2 * kLength) / std::sqrt(1 + nu * nu * k * k * polar_radius2_m2);
}

/// The n-th torsional mode, Hz; `stiffness`: Saint Venant's constant over the polar moment.
double TorsionalHz(int n, double stiffness) {
  return n * std::sqrt(stiffness * ToLame(kSteel).mu_pa / kSteelDensity) / (2 * kLength);
}

TEST(SquareBar, TwistsStretchesAndBendsAsTheClosedFormsSay) {
  const TetMesh mesh = MakeTetBox({kLength, kSide, kSide}, {20, 4, 4}, 10);
  const BarModes bar{mesh, ModesOf(mesh, kSteel, kSteelDensity, 18'000), kSide / 2, kSide / 2};
  // Saint Venant: J = 0.140577 a^4 over a^4 / 6, which four elements across give 0.4 % too stiff: a
  // mode's frequency half of that, a little more the more warping takes.
  ExpectSeries(
      bar.Of(Family::kTorsional), 1, 3, [](int n) { return TorsionalHz(n, 0.140577 * 6); }, 0.005);
  // The section breathes a little otherwise than Love has it.
  ExpectSeries(
      bar.Of(Family::kLongitudinal), 1, 2,
      [](int n) { return LongitudinalHz(n, kSide * kSide / 6); }, 0.0005);
  const std::vector<double> bending = bar.Of(Family::kBending);
  const FreeBeam beam = RectangularBeam(kLength, kSide, kSide);
  ExpectSeries(
      bending, 1, 1, [&](int) { return FirstBendingHz(beam); }, 0.001);
  // The cells are cut along one diagonal of the section: the mesh is no square to the last digit.
  ExpectPairs(bending, 4, 1e-3);
}

// A round bar, meshed as any surface is.
TEST(RoundBar, TwistsStretchesAndBendsAsTheClosedFormsSay) {
  constexpr double kRadius = 0.012;
  const TetMesh mesh =
      Tetrahedralize(MakeRodSurface(kRadius, kLength, 24, 30), {.keep_surface = true}).value();
  const BarModes bar{mesh, ModesOf(mesh, kSteel, kSteelDensity, 12'000)};
  // Its torsional waves are shear waves. A polygon of 24 corners with the circle's area is stiffer
  // by some parts in ten thousand.
  ExpectSeries(
      bar.Of(Family::kTorsional), 1, 2, [](int n) { return TorsionalHz(n, 1); }, 5e-4);
  ExpectSeries(
      bar.Of(Family::kLongitudinal), 1, 1,
      [](int n) { return LongitudinalHz(n, kRadius * kRadius / 2); }, 1e-4);
  // No direction is distinguished but by the mesh, whose elements have no order at all.
  ExpectPairs(bar.Of(Family::kBending), 3, 5e-5);
}

constexpr Point kFlatBar{0.2, 0.02, 0.012};

/// Bending in the plane of the smaller height, which is the lower in pitch.
double BeamTheoryHz() {
  return FirstBendingHz(RectangularBeam(kFlatBar[0], kFlatBar[2], kFlatBar[1]));
}

/// The first mode over that of the theory.
double FirstMode(const TetMesh& mesh, MassSharing sharing = MassSharing::kConsistent) {
  return FrequenciesHz(ModesOf(mesh, kSteel, kSteelDensity, 5000, sharing))[0] / BeamTheoryHz();
}

TEST(FreeBar, FirstBendingModeMatchesBeamTheory) {
  const TetMesh mesh = MakeTetBox(kFlatBar, {16, 2, 2}, 10);
  // Timoshenko's theory and three dimensions differ by a few parts in ten thousand at this ratio of
  // length to height.
  EXPECT_NEAR(FirstMode(mesh), 1, 0.001);
  EXPECT_NEAR(FirstMode(mesh, MassSharing::kLumped), 1, 0.005);
}

TEST(FreeBar, LinearElementsConvergeToBeamTheoryFromAbove) {
  double previous = 10;  // relative error
  for (const int n : {1, 2, 4}) {
    const double error = FirstMode(MakeTetBox(kFlatBar, {16 * n, 2 * n, n}, 4)) - 1;
    EXPECT_GT(error, 0);
    EXPECT_LT(error, previous / 2);  // the theory: a quarter, once the mesh is fine
    previous = error;
  }
  EXPECT_LT(previous, 0.15);
}

// Twelve triangles are all that a CAD program gives for a bar: the surface must be refined, else
// the elements are as long as the bar.
TEST(FreeBar, TwelveTrianglesSuffice) {
  const TetMesh mesh = Tetrahedralize(MakeBoxSurface(kFlatBar), {}).value();
  EXPECT_NEAR(FirstMode(mesh), 1, 0.01);
}

// A square bar fixed at one end against closed forms.

TetMesh FixedAtOneEnd(const Point& size, const std::array<int, 3>& cells) {
  TetMesh mesh = MakeTetBox(size, cells, 10);
  EXPECT_TRUE(FixNodes({FixedPlane{{0, 0, 0}, {1, 0, 0}}}, BoundarySurface(mesh), {}, mesh).ok());
  return mesh;
}

/// The n-th frequency of quarter waves of this speed.
double QuarterWaveHz(int n, double speed) { return (2 * n - 1) * speed / (4 * kLength); }

TEST(Cantilever, BendsTwistsAndStretchesAsTheClosedFormsSay) {
  const TetMesh mesh = FixedAtOneEnd({kLength, kSide, kSide}, {20, 4, 4});
  const BarModes bar{mesh, ModesOf(mesh, kSteel, kSteelDensity, 14'000), kSide / 2, kSide / 2};
  EXPECT_EQ(bar.modes.verification.rigid_mode_count, 0);
  EXPECT_EQ(bar.modes.verification.sturm_count, bar.modes.modes.eigenvalues.size());
  // Beam theory lets a clamped section grow narrower. Here the section is fixed, so that the bar is
  // as stiff as one that is shorter by some tenths of its side.
  const FreeBeam beam = RectangularBeam(kLength, kSide, kSide);
  const std::vector<double> bending = bar.Of(Family::kBending);
  ExpectSeries(
      bending, 2, 4, [&](int n) { return ClampedBendingHz(beam, n); }, 0.012);
  // A square bends alike in both planes; the cells are cut along one diagonal, not both.
  ExpectPairs(bending, 4, 1e-3);
  // Saint Venant: J = 0.140577 a^4 over the polar moment a^4 / 6. Fixed flat where it would warp:
  // stiffer.
  const double twist_speed = std::sqrt(ToLame(kSteel).mu_pa / kSteelDensity * 0.140577 * 6);
  ExpectSeries(
      bar.Of(Family::kTorsional), 1, 2, [&](int n) { return QuarterWaveHz(n, twist_speed); },
      0.012);
  // Inertia across the axis lowers the higher one by a part in a thousand (Rayleigh).
  const double stretch_speed = std::sqrt(kSteel.young_pa / kSteelDensity);
  ExpectSeries(
      bar.Of(Family::kLongitudinal), 1, 2, [&](int n) { return QuarterWaveHz(n, stretch_speed); },
      0.01);
}

// A metre of wire: its stiffest node is 1e12 times as stiff as its lowest mode, so that residuals
// cannot be small; its frequencies must be right, and the proof must own up to the residual.
TEST(SlenderCantilever, IsSolvedAsWellAsRoundingLetsIt) {
  constexpr double kThickness = 0.004;
  const TetMesh mesh = FixedAtOneEnd({1, kThickness, kThickness}, {250, 1, 1});
  const DeformationModes modes = ModesOf(mesh, kSteel, kSteelDensity, 400);
  const FreeBeam beam = RectangularBeam(1, kThickness, kThickness);
  // One element across is too stiff by some parts in a thousand.
  ExpectSeries(
      FrequenciesHz(modes), 2, 6, [&](int n) { return ClampedBendingHz(beam, n); }, 0.005);
  EXPECT_GT(modes.verification.max_residual, 1e-6);
  EXPECT_LT(modes.verification.max_residual, 1e-3);
}

// Tabulated wherever beams are.
TEST(ClampedBeam, SlenderOneHasTheRootsOfEuler) {
  const FreeBeam beam = RectangularBeam(10, 0.01, 0.01);
  const double scale =
      std::sqrt(kSteel.young_pa * beam.second_moment_m4 / (kSteelDensity * beam.area_m2)) /
      (2 * std::numbers::pi * 100);
  const std::array<double, 3> roots = {1.875104, 4.694091, 7.854757};
  for (int order = 1; order <= 3; ++order) {
    const double euler = roots[static_cast<size_t>(order - 1)];
    EXPECT_NEAR(ClampedBendingHz(beam, order) / (scale * euler * euler), 1, 1e-4);
  }
}

}  // namespace
}  // namespace carillon::precompute
