// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/solve_radiation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/gmres.h"
#include "precompute/radiation/mode_radiation.h"

namespace carillon::precompute {
namespace {

/// Returns I = Im(integral of p conj(q)) / k over the surface, from which the radiated power
/// follows as W = rho0 c k^2 I / 2.
double SurfacePowerIntegral(const AcousticSurface& surface, double wavenumber,
                            std::span<const ComplexFloat> p, const Displacement& displacement) {
  double flow = 0;
  for (size_t v = 0; v < surface.vertex_count(); ++v) {
    const Point& n = surface.area_vectors[v];
    const auto& u = displacement[v];
    flow += p[v].imag() * (n[0] * u[0] + n[1] * u[1] + n[2] * u[2]);
  }
  return -flow / wavenumber;
}

double Decibels(double power_ratio) { return 10 * std::log10(power_ratio); }

}  // namespace

std::vector<ModeField> SolveRadiation(const ModeProblem& problem, const RemeshedSurface& level,
                                      const RadiatingSurface& body, const SphereGrid& grid,
                                      Workers& workers) {
  const double k = problem.wavenumber;
  const BoundaryOperator equation(level.surface, level.near, body.center, body.radius_m, k);
  const auto apply = [&](std::span<const std::vector<ComplexFloat>> inputs,
                         std::span<std::vector<ComplexFloat>> results) {
    equation.Apply(inputs, results, workers);
  };
  std::vector<GmresSolution> solutions =
      SolveGmres(apply, equation.Diagonal(), equation.RightSides(problem.displacements, workers),
                 problem.starts, {.tolerance = problem.tolerance});
  std::vector<ModeField> fields;
  for (size_t s = 0; s < solutions.size(); ++s) {
    ModeField& field = fields.emplace_back();
    field.pressure = std::move(solutions[s].x);
    field.residual = solutions[s].residual;
    field.iterations = solutions[s].iterations;
    const Displacement& displacement = problem.displacements[s];
    field.pattern =
        FarPattern(level.surface, body.center, k, field.pressure, displacement, grid, workers);
    field.power_integral = PowerIntegral(field.pattern, grid);
    field.surface_power_db =
        Decibels(SurfacePowerIntegral(level.surface, k, field.pressure, displacement) /
                 field.power_integral);
  }
  return fields;
}

double PowerDifferenceDb(const ModeField& a, const ModeField& b) {
  return Decibels(a.power_integral / b.power_integral);
}

double DirectionDifferenceDb(std::span<const std::complex<double>> a,
                             std::span<const std::complex<double>> b, const SphereGrid& grid) {
  constexpr double kWithin = 1e-2;
  double strongest = 0, weight = 0, sum = 0;
  for (const auto& p : b) strongest = std::max(strongest, std::norm(p));
  for (size_t d = 0; d < b.size(); ++d) {
    if (std::norm(b[d]) < kWithin * strongest) continue;
    const double off = Decibels(std::max(1e-12, std::norm(a[d]) / std::norm(b[d])));
    sum += grid.weights()[d] * off * off;
    weight += grid.weights()[d];
  }
  return weight > 0 ? std::sqrt(sum / weight) : 0;
}

}  // namespace carillon::precompute
