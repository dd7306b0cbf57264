// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/rigid_radiation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "precompute/mesh/point_math.h"
#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/solve_radiation.h"
#include "precompute/radiation/spherical_harmonics.h"

namespace carillon::precompute {
namespace {

using Complex = std::complex<double>;
using Harmonics = std::array<Complex, kRigidHarmonicCount>;

/// Limits of the wavenumbers: the level's edges in the shortest wave, and the ratio of the longest
/// to the shortest wave.
constexpr double kEdgesPerWave = 2.5;
constexpr double kRange = 60;
constexpr double kTolerance = 2e-2;
/// Range and number of the radii that are tried, in radii of the sphere around the body.
constexpr double kLeastRadius = 0.02;
constexpr double kGreatestRadius = 1.25;
constexpr int kRadiusSteps = 120;

/// The solution for one motion at one wavenumber.
struct Solved {
  double wavenumber;
  double power_integral;
  Harmonics harmonics;  ///< c_lm
};

Displacement RigidDisplacement(const AcousticSurface& surface, const Point& center, size_t motion) {
  Displacement displacement;
  Point axis{};
  axis[motion % 3] = 1;
  for (const Point& p : surface.mesh.vertices) {
    const Point u = motion < 3 ? axis : Cross(axis, Difference(p, center));
    displacement.push_back(
        {static_cast<float>(u[0]), static_cast<float>(u[1]), static_cast<float>(u[2])});
  }
  return displacement;
}

/// Returns h_l'(x), the derivative of the spherical Hankel function of the first kind.
Complex HankelSlope(int l, double x) {
  const Complex i(0, 1);
  const Complex wave = std::exp(i * x) / x;
  const Complex h0 = -i * wave;
  const Complex h1 = -wave * (1.0 + i / x);
  if (l == 0) return -h1;
  if (l == 1) return h0 - 2.0 / x * h1;
  return h1 - 3.0 / x * (3.0 / x * h1 - h0);
}

int OrderOf(size_t harmonic) { return harmonic == 0 ? 0 : harmonic < 4 ? 1 : 2; }

/// Returns c_lm of a sphere that moves by Y_lm.
Complex SphereResponse(size_t harmonic, double wavenumber, double radius_m) {
  return 1.0 / (wavenumber * HankelSlope(OrderOf(harmonic), wavenumber * radius_m));
}

/// Computes the strengths of the sphere of this radius by least squares. Differences are relative
/// to the power at each wavenumber. Returns the remaining sum of squares.
double FitStrengths(const std::vector<Solved>& solved, double radius_m,
                    std::array<double, kRigidHarmonicCount>& strengths) {
  double left = 0;
  for (size_t i = 0; i < kRigidHarmonicCount; ++i) {
    double product = 0, square = 0;
    for (const Solved& at : solved) {
      const Complex response = SphereResponse(i, at.wavenumber, radius_m);
      const double weight = 1 / std::max(at.wavenumber * at.wavenumber * at.power_integral,
                                         std::numeric_limits<double>::min());
      product += weight * (std::conj(response) * at.harmonics[i]).real();
      square += weight * std::norm(response);
    }
    strengths[i] = product / square;
    for (const Solved& at : solved) {
      const Complex off =
          at.harmonics[i] - strengths[i] * SphereResponse(i, at.wavenumber, radius_m);
      left += std::norm(off) / (at.wavenumber * at.wavenumber * at.power_integral);
    }
  }
  return left;
}

/// Returns the error of the equivalent sphere's power, dB, root mean square over the wavenumbers.
double ErrorDb(const std::vector<Solved>& solved, const RigidRadiation::Motion& motion) {
  double sum = 0;
  for (const Solved& at : solved) {
    double power = 0;
    for (size_t i = 0; i < kRigidHarmonicCount; ++i) {
      power += std::norm(motion.strengths[i] * SphereResponse(i, at.wavenumber, motion.radius_m));
    }
    const double off_db =
        10 * std::log10(power / (at.wavenumber * at.wavenumber * at.power_integral));
    sum += off_db * off_db;
  }
  return std::sqrt(sum / static_cast<double>(solved.size()));
}

RigidRadiation::Motion FitSphere(const std::vector<Solved>& solved, double body_radius_m) {
  RigidRadiation::Motion best;
  for (const Solved& at : solved) best.power_integrals.push_back(at.power_integral);
  double least = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kRadiusSteps; ++step) {
    const double part = static_cast<double>(step) / kRadiusSteps;
    const double radius_m =
        body_radius_m * kLeastRadius * std::pow(kGreatestRadius / kLeastRadius, part);
    std::array<double, kRigidHarmonicCount> strengths{};
    const double left = FitStrengths(solved, radius_m, strengths);
    if (!(left < least)) continue;
    least = left;
    best.radius_m = radius_m;
    best.strengths = strengths;
  }
  // A motion that moves no air, such as the rotation of a sphere, has no power to compare.
  if (std::isfinite(least)) best.error_db = ErrorDb(solved, best);
  return best;
}

Solved Expand(const ModeField& field, double wavenumber, const SphereGrid& grid) {
  Solved result{.wavenumber = wavenumber, .power_integral = field.power_integral, .harmonics = {}};
  const std::vector<Complex> pattern = grid.Analyse(field.pattern);
  for (size_t i = 0; i < kRigidHarmonicCount; ++i) {
    // This factor is k i^(l + 1).
    const Complex turn = wavenumber * std::pow(Complex(0, 1), OrderOf(i) + 1);
    result.harmonics[i] = turn * pattern[i];
  }
  return result;
}

}  // namespace

std::vector<double> RigidWavenumbers(const RemeshedSurface& level, double greatest_wavenumber) {
  const double limit = 2 * std::numbers::pi / (kEdgesPerWave * level.surface.mean_edge_m);
  const double greatest = std::min(limit, greatest_wavenumber);
  std::vector<double> wavenumbers;
  for (size_t i = 0; i < kRigidWavenumberCount; ++i) {
    const double part = static_cast<double>(i) / (kRigidWavenumberCount - 1);
    wavenumbers.push_back(greatest * std::pow(kRange, part - 1));
  }
  return wavenumbers;
}

RigidRadiation SolveRigidMotions(const MassProperties& mass, const RemeshedSurface& level,
                                 const RadiatingSurface& body, std::vector<double> wavenumbers,
                                 Workers& workers) {
  RigidRadiation result{.mass = mass, .wavenumbers = std::move(wavenumbers), .motions = {}};
  std::array<std::vector<Solved>, kRigidMotionCount> solved;
  for (const double k : result.wavenumbers) {
    const SphereGrid grid(PatternOrder(k, body.radius_m));
    for (size_t motion = 0; motion < kRigidMotionCount; motion += 2) {
      ModeProblem problem{.wavenumber = k, .tolerance = kTolerance};
      for (const size_t m : {motion, motion + 1}) {
        problem.displacements.push_back(RigidDisplacement(level.surface, mass.center_of_mass, m));
      }
      const std::vector<ModeField> fields = SolveRadiation(problem, level, body, grid, workers);
      for (size_t s = 0; s < 2; ++s) solved[motion + s].push_back(Expand(fields[s], k, grid));
    }
  }
  for (size_t motion = 0; motion < kRigidMotionCount; ++motion) {
    result.motions[motion] = FitSphere(solved[motion], body.radius_m);
  }
  return result;
}

}  // namespace carillon::precompute
