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

/// Adds a warning if fewer modes were computed than the band has. `extent_m` is the diagonal of the
/// box around the mesh.
void WarnOfLowerBand(const DeformationModes& solution, const IntendedUse& use, double extent_m,
                     ModalModel& model);

/// Adds a warning for each budget of `goal` that was exceeded, by `used_s` seconds of processor
/// time or `used_bytes` of memory.
void WarnOfOverruns(const ResolutionGoal& goal, double used_s, double used_bytes,
                    ModalModel& model);

/// Adds a warning if the estimated errors of some frequencies are above kGreatError.
void WarnOfGreatErrors(ModalModel& model);

/// Adds a warning if the accuracy that `goal` asks for was not reached.
void WarnOfAccuracy(const ResolutionGoal& goal, ModalModel& model);

}  // namespace carillon::precompute
