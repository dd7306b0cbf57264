// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Returns the processor time of this process and of its children that have ended, seconds.
double CpuSeconds();

/// Measures how long solutions and surfaces take, and predicts the times of the next ones from
/// these measurements.
class SolveTime {
 public:
  /// Returns the processor time since the object was made, seconds.
  double Used() const { return CpuSeconds() - begun_s_; }

  /// Records the time of a solution. `pairs` is the number of pairs of vertices to which the
  /// operator was applied.
  void TakeSolution(double seconds, double pairs);
  void TakeSurface(double seconds) { surface_s_ = seconds; }

  double PredictSolution(double pairs) const { return pairs * seconds_per_pair_; }
  double PredictSurface() const { return surface_s_; }

 private:
  double begun_s_ = CpuSeconds();
  double measured_s_ = 0;
  double measured_pairs_ = 0;
  double seconds_per_pair_ = 1.5e-9;  ///< until it is measured
  double surface_s_ = 2;              ///< until it is measured
};

}  // namespace carillon::precompute
