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
  /// The speed ratio: sqrt(E/rho) of the material divided by the speed of sound in air. A mode
  /// whose eigenvalue for unit E and rho is Lambda radiates at the wavenumber k = speed_ratio *
  /// sqrt(Lambda).
  double speed_ratio = 0;
  Air air;
  /// Modes with wavenumbers between these bounds are computed, 1/m, for the body at the size of its
  /// mesh.
  double least_wavenumber = 0;
  double greatest_wavenumber = 0;
  /// The goal for the estimated error of a mode's power. Surfaces are made finer until it is met,
  /// and until the root mean square error of the directions is below three times the goal.
  double goal_db = 2;
  /// No solution is started that would exceed this processor time, as SolveTime counts it. Zero
  /// means no limit.
  double budget_cpu_s = 0;
  int thread_count = 1;
};

struct Transfer {
  RadiationSettings settings;
  Point center{};
  double radius_m = 0;
  std::vector<ModeRadiation> modes;
  RigidRadiation rigid;  ///< has no wavenumbers if the budget did not allow it
  double cpu_s = 0;
};

/// Called with the estimated fraction of the work that is done, 0 to 1.
using RadiationProgress = std::function<void(double fraction)>;

/// Solves for the radiation of each mode within the bounds of the settings, the most needed modes
/// (SortByNeed) first. Two modes whose wavenumbers differ by less than 0.2 % share their mean
/// wavenumber. If the budget allows, each mode is solved on at least two surfaces, one 1.41 times
/// as fine as the other, and the error is estimated from their difference. The rigid motions of the
/// body are solved first if they take at most a quarter of the budget.
///
/// Errors: those of MakeRemeshedSurface.
absl::StatusOr<Transfer> ComputeTransfer(const SurfaceModes& modes,
                                         const RadiationSettings& settings,
                                         const RadiationProgress& on_progress);

}  // namespace carillon::precompute
