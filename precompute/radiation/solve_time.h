// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Returns the processor time of this process and of its children that have ended, seconds.
double CpuSeconds();

/// Counts the work of a transfer as the processor time that it takes on one core of 2.5 GHz with
/// AVX-512. Measured times would depend on the machine and its load. The modes that a budget
/// reaches would then depend on them, too, and the same body would sound different from one day to
/// the next.
class SolveTime {
 public:
  /// Returns the time of a solution. `pairs` is the number of pairs of vertices to which the
  /// operator is applied.
  static double OfSolution(double pairs) { return pairs * kSecondsPerPair; }
  /// Returns the time of making a surface that has `vertex_count` vertices.
  static double OfSurface(double vertex_count) { return vertex_count * kSecondsPerVertex; }

  void Add(double seconds) { used_s_ += seconds; }

  /// Returns the time of all that was added, seconds.
  double used_s() const { return used_s_; }

 private:
  static constexpr double kSecondsPerPair = 1.3e-9;
  static constexpr double kSecondsPerVertex = 2e-4;

  double used_s_ = 0;
};

}  // namespace carillon::precompute
