// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "precompute/radiation/acoustic_surface.h"
#include "precompute/radiation/remeshed_surface.h"
#include "precompute/radiation/spherical_harmonics.h"

namespace carillon::precompute {

/// The solution for one mode on one surface.
struct ModeField {
  std::vector<ComplexFloat> pressure;         ///< on the surface, for dp/dn = n . phi
  std::vector<std::complex<double>> pattern;  ///< at the directions of the grid
  double power_integral = 0;                  ///< integral of |pattern|^2
  double surface_power_db = 0;
  double residual = 0;
  int iterations = 0;
};

/// The problem of one mode, or of two modes that are solved at the same wavenumber.
struct ModeProblem {
  double wavenumber = 0;
  std::vector<Displacement> displacements = {};
  std::vector<std::vector<ComplexFloat>> starts =
      {};                   ///< first guesses of the pressures; zero if empty
  double tolerance = 1e-2;  ///< of the residual
};

/// Solves the problem on one surface, and computes the far patterns at the directions of the grid.
std::vector<ModeField> SolveRadiation(const ModeProblem& problem, const RemeshedSurface& level,
                                      const RadiatingSurface& body, const SphereGrid& grid,
                                      Workers& workers);

/// Returns 10 log10 of the ratio of the power integral of `a` to that of `b`.
double PowerDifferenceDb(const ModeField& a, const ModeField& b);

/// Returns the root mean square of the level difference of two patterns, dB, over the directions of
/// the grid in which `b` is within 20 dB of its strongest direction.
double DirectionDifferenceDb(std::span<const std::complex<double>> a,
                             std::span<const std::complex<double>> b, const SphereGrid& grid);

}  // namespace carillon::precompute
