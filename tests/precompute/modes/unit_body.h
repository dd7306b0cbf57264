// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/error_estimate.h"

namespace carillon::precompute {

inline const SolveWatch kSilent = [](SolveStage, double) {};
constexpr ElasticConstants kUnitElastic{.young_pa = 1, .poisson_ratio = 0.3};

/// All modes below an eigenvalue of a body of unit density; a refusal ends the test.
inline DeformationModes ModesBelow(double limit, const TetMesh& mesh,
                                   const ElasticConstants& elastic = kUnitElastic) {
  const SystemMatrices system = Assemble(mesh, elastic, 1, MassSharing::kConsistent);
  return SolveDeformationModes(system, mesh, limit, kSilent).value();
}

/// Bounds of an estimated error as parts of the true one, and beside them.
struct ErrorBounds {
  double least, most;
  double beside = 0;
  double least_true = -1;
};

/// Expects the estimated errors of the first modes of a mesh to lie near those against a finer one.
inline void ExpectErrorsNearTruth(const TetMesh& mesh, const DeformationModes& coarse,
                                  const DeformationModes& fine, Eigen::Index count,
                                  const ErrorBounds& bounds) {
  const Eigen::VectorXd errors = EstimateFrequencyErrors(mesh, kUnitElastic, coarse.modes).errors;
  ASSERT_GE(fine.modes.eigenvalues.size(), count);
  ASSERT_GE(errors.size(), count);
  for (Eigen::Index m = 0; m < count; ++m) {
    const double right = std::sqrt(coarse.modes.eigenvalues[m] / fine.modes.eigenvalues[m]) - 1;
    EXPECT_GT(right, bounds.least_true);
    EXPECT_GT(errors[m], bounds.least * right - bounds.beside) << m << ", in truth " << right;
    EXPECT_LT(errors[m], bounds.most * right + bounds.beside) << m << ", in truth " << right;
  }
}

}  // namespace carillon::precompute
