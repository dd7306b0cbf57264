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
  double grain_m = 0;      ///< of its surface, as Grain() measures it
  double node_count = 0;   ///< mid-side nodes, too
  bool thin = false;       ///< nodes grow with the second power of 1 / grain, not with the third
  double worst_error = 0;  ///< zero: it has no mode
  double cpu_s = 0;
  double peak_bytes = 0;
};

/// Corner nodes of the mesh to begin with.
inline constexpr int kFirstCornerNodeCount = 1500;

/// Grain in metres of the next mesh to try, or none where the last one is good enough, or the best
/// that the goal allows. Errors fall with a power of the grain that the last two rounds show; time
/// and memory grow with powers of the nodes that solids show.
std::optional<double> NextGrain(const ResolutionGoal& goal, const std::vector<Round>& rounds);

/// How many times as long as `last` a round with that grain will take.
double TimeGrowth(const Round& last, double grain_m);

/// What a user is told of each budget that was overrun; nothing where both were kept to. The first
/// round is solved whatever it takes, and later ones are only foretold.
std::vector<std::string> OverrunWarnings(const ResolutionGoal& goal, double used_s,
                                         double used_bytes);

/// What the rounds after the first one will take, in times of it, before its errors are known; and
/// those after a later one, which is meant to be the last.
inline constexpr double kLaterRoundsAfterFirst = 6, kLaterRounds = 0.1;

}  // namespace carillon::precompute
