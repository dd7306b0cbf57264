// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "precompute/radiation/mass_properties.h"
#include "precompute/radiation/mode_radiation.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/radiation/surface_level.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Translation by 1 m along x, y and z, then rotation by 1 rad about parallels to them through the
/// centre of mass.
inline constexpr size_t kRigidMotionCount = 6;
/// The harmonics of orders 0, 1 and 2, by which the equivalent spheres move.
inline constexpr size_t kRigidHarmonicCount = 9;
/// Wavenumbers at which they are solved.
inline constexpr size_t kRigidWavenumberCount = 8;

/// How a body radiates that one blow accelerates as a whole: acceleration noise (Chadwick, Zheng
/// and James, "Precomputed acceleration noise for improved rigid-body sound", 2012).
///
/// Each motion has an equivalent sphere: one of radius a that moves along its normals by the sum of
/// s_lm Y_lm over l <= 2 radiates the harmonics c_lm = s_lm / (k h_l'(k a)). For l = 1 the far
/// pattern is -a^2 s_1m Y_1m sigma exp(sigma) / (2 + 2 sigma + sigma^2) with sigma = -i k a: two
/// poles and a delay. Both a and s_lm are fitted to boundary-element solutions at some wavenumbers.
struct RigidRadiation {
  MassProperties mass;
  std::vector<double> wavenumbers;  ///< at which the equation was solved, ascending
  struct Motion {
    std::vector<double> power_integrals;                  ///< of each wavenumber: integral of |P|^2
    double radius_m = 0;                                  ///< a
    std::array<double, kRigidHarmonicCount> strengths{};  ///< s_lm, at l^2 + l + m
    double error_db = 0;  ///< root mean square difference of the fit's power over the wavenumbers
  };
  std::array<Motion, kRigidMotionCount> motions;
};

/// In equal ratios up to the shortest wave that the level resolves, or to `greatest_wavenumber` if
/// that is less; the longest wave is 60 times as long.
std::vector<double> RigidWavenumbers(const SurfaceLevel& level, double greatest_wavenumber);

/// Solves the six motions at these wavenumbers, and fits the equivalent spheres.
RigidRadiation SolveRigidMotions(const MassProperties& mass, const SurfaceLevel& level,
                                 const RadiatingSurface& body, std::vector<double> wavenumbers,
                                 Workers& workers);

}  // namespace carillon::precompute
