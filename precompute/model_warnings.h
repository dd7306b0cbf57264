// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/intended_use.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/modal_model.h"
#include "precompute/resolution.h"

namespace carillon::precompute {

/// Warns that the number of nodes asked for is that of the first mesh, if the request also has a
/// goal, which decides the last one.
void WarnOfNodesBesideGoal(int asked_corner_count, const ResolutionGoal& goal, ModalModel& model);

/// The cost of a body above which modes of a band that nobody asked for are left out.
inline constexpr Means kUsualMeans{.bytes = size_t{7} << 30U, .cpu_s = 60};
/// Largest estimated error of a frequency that goes without a warning: nearly two semitones.
inline constexpr double kGreatError = 0.1;

/// Adds a warning if fewer modes were computed than the band has. `extent_m` is the diagonal of the
/// box around the mesh.
void WarnOfLowerBand(const DeformationModes& solution, const IntendedUse& use, double extent_m,
                     ModalModel& model);

/// Adds a warning if the estimated errors of some frequencies are above kGreatError.
void WarnOfGreatErrors(ModalModel& model);

/// Adds a warning if the accuracy that `goal` asks for was not reached.
void WarnOfAccuracy(const ResolutionGoal& goal, ModalModel& model);

}  // namespace carillon::precompute
