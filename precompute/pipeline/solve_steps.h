// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "carillon/v1/decomposition.pb.h"
#include "precompute/eigen/solve_cost.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/pipeline/decomposition_observer.h"

namespace carillon::precompute {

/// Returns the phase that users are told for a stage of the solution.
v1::Phase PhaseOf(SolveStage stage);

/// Returns the steps after the assembly of the matrices, with their predicted times.
std::vector<PlannedStep> PlanOf(const SolveCost& cost);

}  // namespace carillon::precompute
