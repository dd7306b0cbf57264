// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Processor time of this process and of its children that have ended, seconds.
double CpuSeconds();

/// Measures how long solutions and surfaces take, and predicts the next ones from that.
class SolveTime {
 public:
  /// Since the object was made, seconds.
  double Used() const { return CpuSeconds() - begun_s_; }

  /// `pairs`: pairs of vertices that the operator was applied to.
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
