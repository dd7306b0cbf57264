// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/intended_use.h"
#include "precompute/pipeline/resolution.h"

namespace carillon::precompute {

/// If a request has a number of nodes and also a goal, warns that the number applies to the first
/// mesh only, because the goal decides the last mesh.
void WarnOfNodesBesideGoal(int asked_corner_count, const ResolutionGoal& goal, ModalModel& model);

/// The cost above which some modes of a body are left out, if the request does not state the band.
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
