// SPDX-License-Identifier: AGPL-3.0-or-later
//
// radiation_spheres exact: spheres of every order to 6 against the closed form.
// radiation_spheres dense: the equation solved by sweeps and GMRES beside its assembled matrix,
// factorized, in one thread.
// radiation_spheres fork: levels round the tines of a tuning fork. Each prints a Markdown table.
#include <sys/resource.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string_view>
#include <vector>

#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/gmres.h"
#include "precompute/radiation/solve_radiation.h"
#include "precompute/radiation/solve_time.h"
#include "tests/precompute/radiation/dense_equation.h"
#include "tests/precompute/radiation/fork.h"
#include "tests/precompute/radiation/spheres.h"

namespace carillon::precompute {
namespace {

double Decibels(double ratio) { return 10 * std::log10(ratio); }

/// The worst difference in level where the exact one is within 20 dB of the strongest.
double WorstDirectionDb(const ModeField& field, int l, int m, double exact_power,
                        const SphereGrid& grid) {
  std::vector<double> exact;
  for (const Point& d : grid.directions()) {
    exact.push_back(exact_power * std::pow(RealHarmonics(l, d)[HarmonicIndex(l, m)], 2));
  }
  const double strongest = *std::max_element(exact.begin(), exact.end());
  double worst = 0;
  for (size_t d = 0; d < exact.size(); ++d) {
    if (exact[d] < 0.01 * strongest) continue;
    worst = std::max(worst, std::abs(Decibels(std::norm(field.pattern[d]) / exact[d])));
  }
  return worst;
}

struct Sphere {
  explicit Sphere(int halvings) {
    level.surface = MakeAcousticSurface(MakeIcosphere(1, halvings));
    level.near = MakeNearCorrection(level.surface, workers);
    body.radius_m = 1;
  }

  Workers workers{1};
  RemeshedSurface level;
  RadiatingSurface body;
};

void PrintCell(Sphere& sphere, double ka, int l) {
  const double exact = ExactPowerIntegral(l, ka, 1);
  constexpr double kLeastEfficiency = 1e-5;
  if (ka * ka * exact < kLeastEfficiency) {
    std::printf(" below -50 dB |");
    return;
  }
  const SphereGrid grid(PatternOrder(ka, 1));
  const ModeProblem problem{.wavenumber = ka,
                            .displacements = {HarmonicMotion(sphere.level.surface.mesh, l, l / 2)},
                            .starts = {},
                            .tolerance = 2e-3};
  const ModeField field =
      SolveRadiation(problem, sphere.level, sphere.body, grid, sphere.workers).front();
  std::printf(" %+.2f / %.2f |", Decibels(field.power_integral / exact),
              WorstDirectionDb(field, l, l / 2, exact, grid));
  std::fflush(stdout);
}

void PrintExact() {
  Sphere sphere(4);
  std::printf("2562 vertices; error of power / worst direction within 20 dB, dB\n\n| ka |");
  for (int l = 0; l <= 6; ++l) std::printf(" l = %d |", l);
  std::printf("\n| --- |");
  for (int l = 0; l <= 6; ++l) std::printf(" --- |");
  for (const double ka :
       {0.1, 0.3, 1.0, std::numbers::pi, 4.4934, 5.0, 7.7253, 10.0, 4 * std::numbers::pi, 20.0}) {
    std::printf("\n| %.4g |", ka);
    for (int l = 0; l <= 6; ++l) PrintCell(sphere, ka, l);
  }
  std::printf("\n");
}

Eigen::VectorXcd ToEigen(const std::vector<ComplexFloat>& values) {
  return Eigen::VectorXcf::Map(values.data(), static_cast<Eigen::Index>(values.size()))
      .cast<std::complex<double>>();
}

void PrintDenseRow(int halvings, double ka) {
  Sphere sphere(halvings);
  const BoundaryOperator equation(sphere.level.surface, sphere.level.near, {0, 0, 0}, 1, ka);
  const std::vector<Displacement> motion = {HarmonicMotion(sphere.level.surface.mesh, 4, 2)};
  double begun_s = CpuSeconds();
  const auto right_sides = equation.RightSides(motion, sphere.workers);
  const auto solution = SolveGmres(
      [&](auto inputs, auto results) { equation.Apply(inputs, results, sphere.workers); },
      equation.Diagonal(), right_sides, {}, {.tolerance = 1e-2});
  const double sweeps_s = CpuSeconds() - begun_s;
  begun_s = CpuSeconds();
  const Eigen::MatrixXcd matrix = AssembleDense(sphere.level.surface, sphere.level.near, ka, 1);
  const double assembly_s = CpuSeconds() - begun_s;
  begun_s = CpuSeconds();
  const Eigen::MatrixXcf single = matrix.cast<ComplexFloat>();
  const Eigen::VectorXcf right =
      Eigen::VectorXcf::Map(right_sides[0].data(), static_cast<Eigen::Index>(equation.size()));
  const Eigen::VectorXcf exact = single.partialPivLu().solve(right);
  const double factor_s = CpuSeconds() - begun_s;
  const Eigen::VectorXcd found = ToEigen(solution[0].x);
  std::printf("| %zu | %.3g | %d | %.2f | %.2f | %.2f | %.1e |\n", equation.size(), ka,
              solution[0].iterations, sweeps_s, assembly_s, factor_s,
              (found - exact.cast<std::complex<double>>()).norm() / found.norm());
  std::fflush(stdout);
}

void PrintDense() {
  std::printf("kernels: %s\n\n", SweepTargetName().c_str());
  std::printf(
      "| vertices | ka | iterations | sweeps, CPU s | assembly, CPU s | LU, CPU s | difference |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const double ka : {5.0, 10.0}) {
    for (const int halvings : {3, 4}) PrintDenseRow(halvings, ka);
  }
}

void PrintFork() {
  constexpr std::array<size_t, 7> kDegrees = {15, 30, 45, 60, 75, 80, 90};
  std::printf("dB against the direction in which the tines move\n\n| distance |");
  for (const size_t degree : kDegrees) std::printf(" %zu degrees |", degree);
  std::printf(" least | at |\n| --- |");
  for (size_t i = 0; i < kDegrees.size() + 2; ++i) std::printf(" --- |");
  for (const double distance_m : {0.05, 0.2, 0.8, 100.0}) {
    const std::vector<double> levels = LevelsRoundFork(distance_m);
    const auto least = std::min_element(levels.begin(), levels.end());
    std::printf("\n| %g m |", distance_m);
    for (const size_t degree : kDegrees) std::printf(" %.1f |", levels[degree]);
    std::printf(" %.0f | %td degrees |", *least, least - levels.begin());
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace
}  // namespace carillon::precompute

int main(int argc, char** argv) {
  const std::string_view part = argc == 2 ? argv[1] : "";
  if (part == "exact") {
    carillon::precompute::PrintExact();
  } else if (part == "dense") {
    carillon::precompute::PrintDense();
  } else if (part == "fork") {
    carillon::precompute::PrintFork();
  } else {
    std::fprintf(stderr, "usage: radiation_spheres exact|dense|fork\n");
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
