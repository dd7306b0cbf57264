// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace carillon::precompute {

/// How fine a mesh is to be, said by what comes of it. Zero: no matter.
struct ResolutionGoal {
  double accuracy = 0;      ///< no mode's frequency further off, relatively, as estimated
  double budget_s = 0;      ///< processor time for all rounds
  double budget_bytes = 0;  ///< memory

  bool given() const { return accuracy > 0 || budget_s > 0 || budget_bytes > 0; }
};

/// A mesh that was solved, what it cost, and how well it did.
struct Round {
  double element_size_m = 0;  ///< of its surface, as SurfaceElementSize() measures it
  double node_count = 0;      ///< mid-side nodes, too
  bool thin = false;          ///< number of nodes ~ element_size^-2, not ^-3
  double worst_error = 0;     ///< zero: it has no mode
  double cpu_s = 0;
  double peak_bytes = 0;
};

/// Corner nodes of the mesh to begin with.
inline constexpr int kFirstCornerNodeCount = 1500;

/// Element size in metres of the next mesh to try; none if the last mesh is good enough, or the
/// best that the goal allows. The last two rounds show the power of the element size with which
/// errors fall. Time and memory grow with powers of the number of nodes, measured on solids.
std::optional<double> NextElementSize(const ResolutionGoal& goal, const std::vector<Round>& rounds);

/// Predicted time of a round with this element size, relative to the round `last`.
double TimeGrowth(const Round& last, double element_size_m);

/// Warnings for the user about each budget that was exceeded. A budget can be exceeded in two ways:
/// the first round is always solved, and later rounds are chosen by a predicted cost.
std::vector<std::string> OverrunWarnings(const ResolutionGoal& goal, double used_s,
                                         double used_bytes);

/// Predicted time of all later rounds, relative to the current one: for the first round, whose
/// errors are not known yet, and for a later round, which should be the last.
inline constexpr double kLaterRoundsAfterFirst = 6, kLaterRounds = 0.1;

}  // namespace carillon::precompute
