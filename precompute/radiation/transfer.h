// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/radiation/spherical_harmonics.h"

namespace carillon::precompute {

struct Air {
  double sound_speed_m_per_s = 343;
  double density_kg_per_m3 = 1.204;
};

struct RadiationSettings {
  /// sqrt(E/rho) of the material over the speed of sound in air: a mode of unit eigenvalue Lambda
  /// radiates at the wavenumber k = speed_ratio * sqrt(Lambda).
  double speed_ratio = 0;
  Air air;
  /// Modes of wavenumbers within are computed, 1/m, of the body as large as its mesh.
  double least_wavenumber = 0;
  double greatest_wavenumber = 0;
  /// Surfaces are made finer until the estimated error of a mode's power is below it (that of its
  /// directions, root mean square, below three times it).
  double goal_db = 2;
  /// Processor time after which nothing more is begun; zero: as long as it takes.
  double budget_cpu_s = 0;
  int thread_count = 1;
};

/// How one mode radiates, for unit density and unit modal displacement. With P the far pattern for
/// dp/dn = n . phi, the outgoing field beyond the body is sum over lm of
/// c_lm h_l(k r) Y_lm(direction), c_lm = k i^(l + 1) P_lm, with r from Transfer::center and Y_lm of
/// RealHarmonics.
struct ModeRadiation {
  bool in_band = false;  ///< was wanted
  bool computed = false;
  double wavenumber = 0;                   ///< 1/m
  double power_integral = 0;               ///< I: integral of |P|^2 over all directions, m^4/kg
  double normal_energy = 0;                ///< integral of (n . phi)^2 over the surface, m^2/kg
  int order = 0;                           ///< the least that keeps I within 0.05 dB
  std::vector<uint32_t> index;             ///< l^2 + l + m of the harmonics kept
  std::vector<std::complex<float>> value;  ///< c_lm of each, scaled so that they give all of I
  double power_error_db = 0;               ///< estimated
  double direction_error_db = 0;  ///< estimated, root mean square within 20 dB of the strongest
  double residual = 0;            ///< of the solution
  double surface_power_db = 0;    ///< power at the surface over that far away
  int vertex_count = 0;           ///< of the finest surface used
  double edge_m = 0;
  int iterations = 0;

  /// Radiated power over that of a plane wave from the same motion, k^2 I / normal_energy.
  double efficiency() const;
  /// Decay by radiation for unit density, rho0 c k^2 I / 2, 1/s.
  double DecayRatePerS(const Air& air) const;
};

struct Transfer {
  RadiationSettings settings;
  Point center{};
  double radius_m = 0;
  std::vector<ModeRadiation> modes;
  double cpu_s = 0;
};

/// Fills order, index and value from the far pattern and the wavenumber and power integral of the
/// mode.
void ExpandPattern(std::span<const std::complex<double>> pattern, const SphereGrid& grid,
                   ModeRadiation& mode);

/// Told the part of the work that is done, estimated, 0 to 1.
using RadiationProgress = std::function<void(double fraction)>;

/// Solves for the radiation of each mode at its own wavenumber, the lowest and loudest first. Each
/// mode is solved on two surfaces at least, one 1.41 times as fine as the other; their difference
/// is the error estimate.
///
/// Errors: those of MakeSurfaceLevel.
absl::StatusOr<Transfer> ComputeTransfer(const SurfaceModes& modes,
                                         const RadiationSettings& settings,
                                         const RadiationProgress& on_progress);

}  // namespace carillon::precompute
