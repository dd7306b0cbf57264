// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/yielding_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "server/excitation/contact.h"
#include "server/excitation/hertz.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTopRadPerS = 2 * kPi * 20000;

struct Body {
  std::string name;
  ElasticBody elastic;
  std::vector<StruckMode> modes;
};

StruckMode ModeAt(double rad_per_s, double shape_squared_per_kg) {
  return {.damped_rad_per_s = rad_per_s,
          .decay_rate_per_s = -0.0005 * rad_per_s,
          .shape_squared_per_kg = shape_squared_per_kg};
}

/// A simply supported plate, struck at the shares 0.31 and 0.43 of its sides:
/// omega = pi^2 (m^2/a^2 + n^2/b^2) (D/(rho h))^(1/2) (Leissa, Vibration of plates, 4.1).
Body Plate(const std::string& name, ElasticBody elastic, double density_kg_per_m3,
           const std::array<double, 3>& size_m) {
  const auto [a, b, h] = size_m;
  elastic.mass_kg = density_kg_per_m3 * a * b * h;
  const double nu = elastic.poisson_ratio;
  const double stiffness = elastic.young_pa * h * h * h / (12 * (1 - nu * nu));
  Body body{.name = name, .elastic = elastic, .modes = {}};
  for (int m = 1; m < 200; ++m) {
    for (int n = 1; n < 200; ++n) {
      const double omega = kPi * kPi * (m * m / (a * a) + n * n / (b * b)) *
                           std::sqrt(stiffness / (density_kg_per_m3 * h));
      if (omega > kTopRadPerS) break;
      const double shape = 2 * std::sin(0.31 * m * kPi) * std::sin(0.43 * n * kPi);
      body.modes.push_back(ModeAt(omega, shape * shape / elastic.mass_kg));
    }
  }
  return body;
}

/// A thin ring that bends in its plane, struck radially; of each pair, the mode that is struck at
/// its antinode: omega^2 = E h^2/(12 rho R^4) n^2 (n^2 - 1)^2/(n^2 + 1) (Love, 293).
Body Ring(const std::string& name, ElasticBody elastic, double density_kg_per_m3, double radius_m,
          double width_m, double wall_m) {
  elastic.mass_kg = density_kg_per_m3 * 2 * kPi * radius_m * width_m * wall_m;
  Body body{.name = name, .elastic = elastic, .modes = {}};
  for (double n = 2; n < 100; ++n) {
    const double omega = wall_m / (radius_m * radius_m) *
                         std::sqrt(elastic.young_pa / (12 * density_kg_per_m3)) * n * (n * n - 1) /
                         std::sqrt(n * n + 1);
    if (omega > kTopRadPerS) break;
    body.modes.push_back(ModeAt(omega, 2 / (1 + 1 / (n * n)) / elastic.mass_kg));
  }
  return body;
}

std::vector<Body> TenBodies() {
  const ElasticBody steel{.young_pa = 2.06e11, .poisson_ratio = 0.29};
  const ElasticBody glass{.young_pa = 7e10, .poisson_ratio = 0.22};
  const ElasticBody bronze{.young_pa = 1.05e11, .poisson_ratio = 0.34};
  const ElasticBody wood{.young_pa = 1.2e10, .poisson_ratio = 0.3};
  return {Plate("sheet", steel, 7850, {0.3, 0.2, 0.0008}),
          Plate("plate", steel, 7850, {0.2, 0.15, 0.002}),
          Plate("thick plate", steel, 7850, {0.1, 0.08, 0.008}),
          Plate("pane", glass, 2500, {0.3, 0.3, 0.003}),
          Plate("gong", bronze, 8700, {0.4, 0.4, 0.0015}),
          Plate("board", wood, 700, {0.5, 0.2, 0.006}),
          Ring("glass", glass, 2500, 0.035, 0.03, 0.0015),
          Ring("bowl", glass, 2400, 0.06, 0.03, 0.003),
          Ring("bell", bronze, 8700, 0.05, 0.03, 0.004),
          Ring("hoop", steel, 7850, 0.15, 0.02, 0.002)};
}

using Octaves = std::array<double, OctaveGains::kCount>;

/// The energies of the modes by octave after a blow at 1 m/s, by the equations of YieldingGains for
/// every mode, with velocity Verlet's method and steps of a hundredth of the contact's own period
/// and of the shortest mode's.
Octaves Reference(const std::vector<StruckMode>& modes, double mass_kg, double duration_s) {
  const double stiffness = std::pow(3.218 / duration_s, 2.5) * mass_kg;
  const double dt = std::min(duration_s / 600, 2 * kPi / kTopRadPerS / 100);
  std::vector<double> u(modes.size()), v(modes.size());
  double x = 0, speed = 1, force = 0;
  for (double t = 0; t < 6e-3; t += dt) {
    speed -= force / mass_kg * dt / 2;
    x += speed * dt;
    double surface = 0;
    for (size_t i = 0; i < modes.size(); ++i) {
      const double omega = modes[i].damped_rad_per_s;
      v[i] += (modes[i].shape_squared_per_kg * force - omega * omega * u[i]) * dt / 2;
      u[i] += v[i] * dt;
      surface += u[i];
    }
    force = x > surface ? stiffness * std::pow(x - surface, 1.5) : 0;
    for (size_t i = 0; i < modes.size(); ++i) {
      const double omega = modes[i].damped_rad_per_s;
      v[i] += (modes[i].shape_squared_per_kg * force - omega * omega * u[i]) * dt / 2;
    }
    speed -= force / mass_kg * dt / 2;
  }
  Octaves energies{};
  for (size_t i = 0; i < modes.size(); ++i) {
    const double omega = modes[i].damped_rad_per_s;
    if (!(modes[i].shape_squared_per_kg > 1e-9)) continue;
    energies[OctaveGains::OctaveOf(omega / (2 * kPi))] +=
        (v[i] * v[i] + omega * omega * u[i] * u[i]) / (2 * modes[i].shape_squared_per_kg);
  }
  return energies;
}

/// The energies of the modes by octave after a raised cosine with these gains.
Octaves ByPulse(const std::vector<StruckMode>& modes, double impulse, double duration_s,
                const OctaveGains& gains) {
  Octaves energies{};
  for (const StruckMode& mode : modes) {
    const std::complex<double> x =
        0.5 * duration_s * std::complex(mode.decay_rate_per_s, mode.damped_rad_per_s);
    const double factor = std::norm(std::sinh(x) / x / (1.0 + x * x / (kPi * kPi)));
    const size_t octave = OctaveGains::OctaveOf(mode.damped_rad_per_s / (2 * kPi));
    const double gain = double{gains.Factor(octave)};
    energies[octave] += gain * gain * impulse * impulse * mode.shape_squared_per_kg * factor / 2;
  }
  return energies;
}

double Sum(const Octaves& octaves) {
  double sum = 0;
  for (const double octave : octaves) sum += octave;
  return sum;
}

/// One of the ten bodies that a striker of 20 g with a radius of 5 mm strikes at 1 m/s.
struct Struck {
  Struck(const Body& body, double striker_young_pa) {
    const ElasticBody striker{.young_pa = striker_young_pa,
                              .poisson_ratio = 0.3,
                              .mass_kg = 0.02,
                              .curvature_per_m = 200};
    mass_kg = ReducedMassKg(body.elastic, striker, {});
    impulse = 2 * mass_kg;
    duration_s = HertzDurationS(body.elastic, striker, {}, impulse);
    gains = YieldingGains(body.modes, {.reduced_mass_kg = mass_kg}, impulse, duration_s);
  }
  double mass_kg = 0, impulse = 0, duration_s = 0;
  OctaveGains gains;
};

TEST(YieldingContact, EachOctaveOfTenBodiesIsWithinTwoDecibelsOfAnExplicitIntegration) {
  for (const Body& body : TenBodies()) {
    for (const double striker_young_pa : {2.06e11, 1.2e9}) {
      const Struck struck(body, striker_young_pa);
      const Octaves right = Reference(body.modes, struck.mass_kg, struck.duration_s);
      const Octaves ours = ByPulse(body.modes, struck.impulse, struck.duration_s, struck.gains);
      for (size_t octave = 0; octave < right.size(); ++octave) {
        // What lies 40 dB below the whole is not heard.
        if (right[octave] < 1e-4 * Sum(right)) continue;
        EXPECT_NEAR(10 * std::log10(ours[octave] / right[octave]), 0, 2)
            << body.name << ", octave " << octave << ", " << struck.duration_s << " s";
      }
    }
  }
}

TEST(YieldingContact, NoBlowGivesTheModesMoreThanTheStrikersEnergy) {
  bool would_exceed = false;
  for (const Body& body : TenBodies()) {
    for (const double striker_young_pa : {2.06e11, 1.2e9, 3.6e6}) {
      const Struck struck(body, striker_young_pa);
      const double most = struck.impulse * struck.impulse / (8 * struck.mass_kg);
      const auto share = [&](const OctaveGains& gains) {
        return Sum(ByPulse(body.modes, struck.impulse, struck.duration_s, gains)) / most;
      };
      EXPECT_LE(share(struck.gains), 1) << body.name;
      would_exceed = would_exceed || share({}) > 5;
    }
  }
  EXPECT_TRUE(would_exceed);
}

TEST(YieldingContact, ABlockSoundsAsByHertz) {
  // One mode of 400 kg of steel.
  const std::vector<StruckMode> modes{ModeAt(2 * kPi * 8000, 1.0 / 400)};
  EXPECT_TRUE(YieldingGains(modes, {.reduced_mass_kg = 0.02}, 0.04, 6.5e-5).none());
}

TEST(YieldingContact, AStatedSpeedSetsTheSpringAndTheImpulseTheLevel) {
  const Body body = TenBodies()[6];
  const auto gains = [&](double impulse, double speed) {
    return YieldingGains(body.modes, {.reduced_mass_kg = 0.0125, .stated_speed_m_per_s = speed},
                         impulse, 1e-4);
  };
  EXPECT_EQ(gains(0.025, 1), gains(0.025, 0));
  EXPECT_EQ(gains(0.0125, 1), gains(0.025, 1));
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr ElasticBody kPlate{
    .young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = 0.1, .curvature_per_m = 0};

TEST(Hertz, TheDurationIsThatOfTheFieldEquationsSolution) {
  // m x'' = -4/3 E sqrt(R) x^(3/2), integrated until the bodies part.
  const ElasticBody ball{
      .young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = 0.05, .curvature_per_m = 100};
  const double mass = 0.1 / 3, radius = 0.01, speed = 0.7, young = 7e10, poisson = 0.3;
  const double modulus = young / (2 * (1 - poisson * poisson));  // both bodies alike
  double x = 0, v = speed, t = 0;
  for (constexpr double kDt = 1e-9; x >= 0; t += kDt) {
    v -= kDt * 4 / 3 * modulus * std::sqrt(radius) * std::pow(x, 1.5) / mass;
    x += kDt * v;
  }
  // The impulse turns the speed of approach round.
  const double duration_s = HertzDurationS(kPlate, ball, {}, 2 * mass * speed);
  EXPECT_NEAR(duration_s, t, 2e-3 * t);  // 2.87 has three digits
}

TEST(Hertz, ASteelTipTouchesSteelCeramicAndWoodForThePublishedTimes) {
  // 20 g, 5 mm, at 1 m/s: a thick body takes twice the momentum.
  const double impulse = 2 * 0.02;
  const auto duration_ms = [&](double young_pa, double poisson_ratio) {
    const ElasticBody wall{
        .young_pa = young_pa, .poisson_ratio = poisson_ratio, .mass_kg = kInfinity};
    return 1e3 * HertzDurationS(wall, kSteelTip, {}, impulse);
  };
  EXPECT_NEAR(duration_ms(2.06e11, 0.29), 0.067, 0.003);
  EXPECT_NEAR(duration_ms(7e10, 0.2), 0.087, 0.005);
  EXPECT_NEAR(duration_ms(1.2e9, 0.3), 0.41, 0.02);
}

TEST(Hertz, WhatIsToldReplacesWhatTheBodiesSay) {
  const HertzContact told{.reduced_mass_kg = 0.02,
                          .reduced_radius_m = 0.005,
                          .approach_speed_m_per_s = 1,
                          .striker_young_pa = 2.06e11,
                          .striker_poisson_ratio = 0.29};
  const ElasticBody soft{.young_pa = 1e6, .poisson_ratio = 0.4, .mass_kg = 7};
  const ElasticBody wall{.young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = kInfinity};
  EXPECT_DOUBLE_EQ(HertzDurationS(wall, soft, told, 123),
                   HertzDurationS(wall, kSteelTip, {}, 0.04));
}

TEST(Hertz, EvenFlatFacesAndHollowsAndNothingTouchForATime) {
  const ElasticBody flat{.young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = 1};
  ElasticBody hollow = flat;
  hollow.curvature_per_m = -500;
  const double on_flat = HertzDurationS(flat, flat, {}, 1);
  EXPECT_GT(on_flat, 1e-5);
  EXPECT_EQ(HertzDurationS(hollow, kSteelTip, {.striker_mass_kg = 1}, 1),
            HertzDurationS(hollow, kSteelTip,
                           {.reduced_radius_m = kFlattestRadiusM, .striker_mass_kg = 1}, 1));
  EXPECT_EQ(HertzDurationS(flat, flat, {}, 0), kLongestContactS);  // they do not approach
}

}  // namespace
}  // namespace carillon
