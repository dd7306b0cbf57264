// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace carillon::precompute {

/// The requirements that determine how fine a mesh must be. Zero means no requirement.
struct ResolutionGoal {
  double accuracy = 0;      ///< largest estimated relative error of any mode's frequency
  double budget_s = 0;      ///< processor time for all rounds
  double budget_bytes = 0;  ///< memory

  bool given() const { return accuracy > 0 || budget_s > 0 || budget_bytes > 0; }
};

/// A mesh that was solved, with the cost and the error of the solution.
struct Round {
  double element_size_m = 0;  ///< of the mesh's surface, as SurfaceElementSize() measures it
  double node_count = 0;      ///< mid-side nodes included
  /// Predicted number of nodes of the uniform mesh of this element size; equal to node_count unless
  /// the mesh is graded.
  double uniform_node_count = 0;
  bool thin = false;       ///< whether the number of nodes grows as element_size^-2, not ^-3
  double worst_error = 0;  ///< zero if the mesh has no mode
  double cpu_s = 0;
  double peak_bytes = 0;
};

/// Number of corner nodes of the first mesh.
inline constexpr int kFirstCornerNodeCount = 1500;

/// Returns the element size, metres, of the next mesh to try. Returns nothing if the last mesh is
/// good enough, or is the best mesh that the goal allows. The power of the element size with which
/// the errors fall is taken from the last two rounds. Time and memory grow with powers of the
/// number of nodes, measured on solids.
std::optional<double> NextElementSize(const ResolutionGoal& goal, const std::vector<Round>& rounds);

/// Returns the number of dimensions in which smaller elements become more numerous.
double Dimension(const Round& round);

/// Returns the predicted number of nodes of the uniform mesh of this element size after `last`.
double UniformNodeCount(const Round& last, double element_size_m);

/// Sets the element size of the last round, whose mesh is graded, to the `asked` size of the
/// uniform mesh that would have the same error. Returns false if the mesh became neither finer nor
/// more accurate than the one before.
bool SetEquivalentSize(double asked_m, std::vector<Round>& rounds);

/// Returns the predicted time of a round with this element size, relative to the round `last`.
double TimeGrowth(const Round& last, double element_size_m);

/// Returns the predicted time of all rounds after the next one, relative to the next one, whose
/// element size NextElementSize() gave.
double LaterRounds(const ResolutionGoal& goal, const std::vector<Round>& rounds);

/// Returns a warning for the user about each budget that was exceeded. A budget can be exceeded in
/// two ways: the first round is always solved, and later rounds are chosen by a predicted cost.
std::vector<std::string> OverrunWarnings(const ResolutionGoal& goal, double used_s,
                                         double used_bytes);

/// Predicted time of all later rounds, relative to the current round. The first number applies
/// while the first round runs, because its errors are not known yet. The second number applies
/// while a later round runs that should be the last.
inline constexpr double kLaterRoundsAfterFirst = 6, kLaterRounds = 0.1;

}  // namespace carillon::precompute
