// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

namespace carillon::precompute {

/// The steps of a decomposition. Factoring, solving and verifying may repeat.
enum class Phase { kRead, kMesh, kAssemble, kFactor, kSolve, kVerify, kWrite };
inline constexpr size_t kPhaseCount = 7;

/// Told how a decomposition goes on, in the thread that does it.
class DecompositionObserver {
 public:
  virtual ~DecompositionObserver() = default;
  /// `fraction`: estimated part of the phase that is done, 0 to 1.
  virtual void OnProgress(Phase phase, double fraction) = 0;
  /// Corner and mid-side nodes, once known.
  virtual void OnMesh(size_t node_count, size_t element_count) = 0;
  /// Verified modes, once known.
  virtual void OnModes(size_t mode_count) = 0;
};

}  // namespace carillon::precompute
