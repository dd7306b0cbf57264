// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/solve_steps.h"

namespace carillon::precompute {

v1::Phase PhaseOf(SolveStage stage) {
  switch (stage) {
    case SolveStage::kFactor:
      return v1::PHASE_FACTOR;
    case SolveStage::kSolve:
      return v1::PHASE_SOLVE;
    case SolveStage::kVerify:
      return v1::PHASE_VERIFY;
  }
  return v1::PHASE_SOLVE;
}

std::vector<PlannedStep> PlanOf(const SolveCost& cost) {
  return {{.phase = v1::PHASE_VERIFY, .predicted_s = cost.count_s},
          {.phase = v1::PHASE_FACTOR, .predicted_s = cost.factor_s},
          {.phase = v1::PHASE_SOLVE, .predicted_s = cost.solve_s},
          {.phase = v1::PHASE_VERIFY, .predicted_s = cost.verify_s},
          {.phase = v1::PHASE_WRITE, .predicted_s = cost.model_s}};
}

}  // namespace carillon::precompute
