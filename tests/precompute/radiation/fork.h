// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "precompute/radiation/remeshed_surface.h"
#include "tests/precompute/radiation/spheres.h"

namespace carillon::precompute {

/// The tines of a tuning fork of 441 Hz: two bars along z that move apart and together along x, as
/// cantilevers clamped at z = 0 do.
struct Fork {
  static constexpr double kLengthM = 0.08;
  static constexpr double kWavenumber = 2 * 3.14159265358979 * 441.3 / 343;

  SurfaceMesh mesh;
  Displacement motion;
};

Fork MakeFork();

/// The pressure of q = dp/dn and p on a surface at a place outside it, by the representation
/// formula and the vertex rule.
std::complex<double> PressureAt(const Point& place, const AcousticSurface& surface,
                                double wavenumber, std::span<const ComplexFloat> p,
                                const Displacement& motion);

/// Levels in dB against the direction in which the tines move, each degree from 0 to 90, round the
/// tines at four fifths of their length.
std::vector<double> LevelsRoundFork(double distance_m);

}  // namespace carillon::precompute
