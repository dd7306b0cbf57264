// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/radiation/spherical_harmonics.h"

namespace carillon::precompute {

struct Air {
  double sound_speed_m_per_s = 343;
  double density_kg_per_m3 = 1.204;
};

/// The radiation of one mode, for unit density and unit modal displacement. With P the far pattern
/// for dp/dn = n . phi, the outgoing field beyond the body is the sum over l and m of
/// c_lm h_l(k r) Y_lm(direction), c_lm = k i^(l + 1) P_lm, with r from Transfer::center and Y_lm of
/// SphereGrid.
struct ModeRadiation {
  bool in_band = false;  ///< whether the mode was requested
  bool computed = false;
  double wavenumber = 0;                   ///< 1/m
  double power_integral = 0;               ///< I: integral of |P|^2 over all directions, m^4/kg
  double normal_energy = 0;                ///< integral of (n . phi)^2 over the surface, m^2/kg
  int order = 0;                           ///< the least order that keeps I within 0.05 dB
  std::vector<uint32_t> index;             ///< l^2 + l + m of the harmonics kept
  std::vector<std::complex<float>> value;  ///< c_lm of each, scaled so that their power is I
  double power_error_db = 0;               ///< estimated
  /// Estimated root mean square over the directions within 20 dB of the strongest one. It includes
  /// the error caused by the harmonics that are not kept.
  double direction_error_db = 0;
  double residual = 0;          ///< residual of the solution
  double surface_power_db = 0;  ///< power at the surface relative to the power far away
  int vertex_count = 0;         ///< number of vertices of the finest surface used
  double edge_m = 0;            ///< mean edge of that surface
  int iterations = 0;

  /// Returns k^2 I / normal_energy, the ratio of the radiated power to that of a plane wave from
  /// the same motion.
  double efficiency() const;
  /// Returns the decay rate by radiation for unit density, rho0 c k^2 I / 2, 1/s.
  double DecayRatePerS(const Air& air) const;
};

/// Integrates |P|^2 over all directions, for the far pattern P at the directions of the grid. The
/// result has the unit of |P|^2, and is ModeRadiation::power_integral for the pattern of a mode.
double PowerIntegral(std::span<const std::complex<double>> pattern, const SphereGrid& grid);

/// Fills order, index and value from the far pattern and the wavenumber and power integral of the
/// mode.
void ExpandPattern(std::span<const std::complex<double>> pattern, const SphereGrid& grid,
                   ModeRadiation& mode);

/// Returns the far pattern of the kept harmonics at the directions of `grid`, whose order must be
/// at least the mode's order.
std::vector<std::complex<double>> KeptPattern(const ModeRadiation& mode, const SphereGrid& grid);

}  // namespace carillon::precompute
