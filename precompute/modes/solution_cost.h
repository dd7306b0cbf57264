// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "precompute/eigen/solve_cost.h"
#include "precompute/sparse/ordered_system.h"

namespace carillon::precompute {

/// The largest cost of a solution. If all modes would cost more, fewer modes are found.
struct Means {
  size_t bytes = 0;  ///< memory, the matrices included
  double cpu_s = 0;  ///< processor time, as PredictSolveCost() predicts it
};

/// Returns whether the dense solver is faster than block Lanczos, according to measurements.
bool PrefersDense(Eigen::Index unknown_count, int mode_count);

/// Returns the predicted cost of finding `mode_count` modes, rigid-body ones included, by the
/// solver that is faster.
SolveCost CostOfSolution(const OrderedSystem& ordered, int mode_count);

/// Returns whether a solution costs at most these means.
bool Afford(const Means& means, const SolveCost& cost);

}  // namespace carillon::precompute
