// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/radiation/mode_radiation.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/radiation/rigid_radiation.h"

namespace carillon::precompute {

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

struct Transfer {
  RadiationSettings settings;
  Point center{};
  double radius_m = 0;
  std::vector<ModeRadiation> modes;
  RigidRadiation rigid;  ///< without wavenumbers where there was no time for it
  double cpu_s = 0;
};

/// Told the part of the work that is done, estimated, 0 to 1.
using RadiationProgress = std::function<void(double fraction)>;

/// Solves for the radiation of each mode at its own wavenumber, the lowest and loudest first. Each
/// mode is solved on two surfaces at least, one 1.41 times as fine as the other; their difference
/// is the error estimate. The motions of the body as a whole are solved first, where they take less
/// than a quarter of the budget.
///
/// Errors: those of MakeSurfaceLevel.
absl::StatusOr<Transfer> ComputeTransfer(const SurfaceModes& modes,
                                         const RadiationSettings& settings,
                                         const RadiationProgress& on_progress);

}  // namespace carillon::precompute
