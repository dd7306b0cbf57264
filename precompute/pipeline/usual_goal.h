// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "precompute/modes/solution_cost.h"
#include "precompute/pipeline/resolution.h"

namespace carillon::precompute {

/// The cost above which some modes of a body are left out, if the request does not state the band.
inline constexpr Means kUsualMeans{.bytes = size_t{7} << 30U, .cpu_s = 60};

/// Largest estimated error of a frequency that goes without a warning: nearly two semitones.
inline constexpr double kGreatError = 0.1;

/// The goal for a surface if nobody asked for another. Its processor time is the predicted one, so
/// that each machine makes the same model. The prediction for thin plates is about half the time
/// that they take.
inline constexpr ResolutionGoal kUsualGoal{.accuracy = kGreatError,
                                           .budget_s = kUsualMeans.cpu_s / 2};

}  // namespace carillon::precompute
