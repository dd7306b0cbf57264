// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace carillon::precompute {

/// The steps of a decomposition. The proof (kVerify) begins before the factorization, with the
/// count of the modes; all but the first may repeat.
enum class Phase { kRead, kMesh, kAssemble, kFactor, kSolve, kVerify, kWrite };
inline constexpr size_t kPhaseCount = 7;

/// A step to come.
struct PlannedStep {
  Phase phase;
  double predicted_s = 0;  ///< on the machine that predictions are made for
};

/// What is known of a mesh before it is made and solved, and of finer ones after it.
struct RoundForecast {
  double expected_s = 0;    ///< by the clock; zero: not known
  double later_rounds = 0;  ///< what the rounds after it will take, in times of this one
};

/// Told how a decomposition goes on, in the thread that does it.
class DecompositionObserver {
 public:
  virtual ~DecompositionObserver() = default;
  /// `fraction`: estimated part of the phase that is done, 0 to 1.
  virtual void OnProgress(Phase phase, double fraction) = 0;
  /// Another mesh is about to be made and solved.
  virtual void OnRound(const RoundForecast& forecast) = 0;
  /// The steps of this round from the count on; told again once more is known.
  virtual void OnPlan(const std::vector<PlannedStep>& steps) = 0;
  /// Corner and mid-side nodes, once known.
  virtual void OnMesh(size_t node_count, size_t element_count) = 0;
  /// Verified modes, once known.
  virtual void OnModes(size_t mode_count) = 0;
};

}  // namespace carillon::precompute
