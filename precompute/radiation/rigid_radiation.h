// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "precompute/radiation/mass_properties.h"
#include "precompute/radiation/mode_radiation.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/radiation/remeshed_surface.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Number of rigid motions: translations by 1 m along x, y and z, then rotations by 1 rad about
/// axes parallel to x, y and z through the centre of mass.
inline constexpr size_t kRigidMotionCount = 6;
/// Number of harmonics by which the equivalent spheres move, which are those of orders 0, 1 and 2.
inline constexpr size_t kRigidHarmonicCount = 9;
/// Number of wavenumbers at which the rigid motions are solved.
inline constexpr size_t kRigidWavenumberCount = 8;

/// The sound that a body radiates when a blow accelerates it as a whole, which is called
/// acceleration noise (Chadwick, Zheng and James, "Precomputed acceleration noise for improved
/// rigid-body sound", 2012).
///
/// Each motion has an equivalent sphere. A sphere of radius a that moves along its normals by the
/// sum of s_lm Y_lm over l <= 2 radiates the harmonics c_lm = s_lm / (k h_l'(k a)). For l = 1 the
/// far pattern is -a^2 s_1m Y_1m sigma exp(sigma) / (2 + 2 sigma + sigma^2) with sigma = -i k a:
/// two poles and a delay. Both a and s_lm are fitted to boundary-element solutions at some
/// wavenumbers.
struct RigidRadiation {
  MassProperties mass;
  std::vector<double> wavenumbers;  ///< at which the equation was solved, ascending
  struct Motion {
    std::vector<double> power_integrals;                  ///< integral of |P|^2 for each wavenumber
    double radius_m = 0;                                  ///< a
    std::array<double, kRigidHarmonicCount> strengths{};  ///< s_lm, at l^2 + l + m
    double error_db = 0;  ///< root mean square difference of the fit's power over the wavenumbers
  };
  std::array<Motion, kRigidMotionCount> motions;
};

/// Returns wavenumbers in equal ratios. The greatest wavenumber belongs to the shortest wave that
/// the level resolves, but is at most `greatest_wavenumber`. The least wavenumber is a sixtieth of
/// the greatest.
std::vector<double> RigidWavenumbers(const RemeshedSurface& level, double greatest_wavenumber);

/// Solves the six motions at these wavenumbers, and fits the equivalent spheres.
RigidRadiation SolveRigidMotions(const MassProperties& mass, const RemeshedSurface& level,
                                 const RadiatingSurface& body, std::vector<double> wavenumbers,
                                 Workers& workers);

}  // namespace carillon::precompute
