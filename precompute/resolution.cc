// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/mesh/mesh_limits.h"

namespace carillon::precompute {
namespace {

/// Quadratic elements: the error of a frequency goes with the fourth power of their size, which is
/// the 4/3 of the nodes of a solid, the square of a wall's.
constexpr double kErrorPower = 1.8;
constexpr double kTimePower = 1.6, kMemoryPower = 1.4;
/// Of the accuracy and the budgets wanted, so that the next round is rarely one too few.
constexpr double kMargin = 0.8;
constexpr double kLeastGrowth = 1.15, kMostGrowth = 4;
constexpr size_t kMostRounds = 6;
/// Corner and mid-side nodes of a mesh for each corner.
constexpr double kNodesPerCorner = 8;

double ErrorPower(const std::vector<Round>& rounds) {
  if (rounds.size() < 2) return kErrorPower;
  const Round& last = rounds.back();
  const Round& before = rounds[rounds.size() - 2];
  const double growth = last.corner_node_count / before.corner_node_count;
  if (!(growth > kLeastGrowth && before.worst_error > 0 && last.worst_error > 0))
    return kErrorPower;
  return std::clamp(std::log(before.worst_error / last.worst_error) / std::log(growth), 0.6, 2.5);
}

/// By how much the nodes may grow before the budget is used up.
double AffordableGrowth(const ResolutionGoal& goal, const std::vector<Round>& rounds) {
  double growth = std::numeric_limits<double>::infinity();
  const Round& last = rounds.back();
  if (goal.budget_s > 0) {
    double left_s = kMargin * goal.budget_s;
    for (const Round& round : rounds) left_s -= round.cpu_s;
    growth = std::pow(std::max(left_s, 0.0) / std::max(last.cpu_s, 1e-3), 1 / kTimePower);
  }
  if (goal.budget_bytes > 0) {
    growth =
        std::min(growth, std::pow(kMargin * goal.budget_bytes / last.peak_bytes, 1 / kMemoryPower));
  }
  return growth;
}

}  // namespace

std::optional<int> NextCornerNodeCount(const ResolutionGoal& goal,
                                       const std::vector<Round>& rounds) {
  const Round& last = rounds.back();
  if (rounds.size() >= kMostRounds) return std::nullopt;
  if (goal.accuracy > 0 && last.worst_error > 0 && last.worst_error <= goal.accuracy) {
    return std::nullopt;
  }
  double growth = kMostGrowth;
  if (goal.accuracy > 0 && last.worst_error > 0) {
    growth = std::pow(last.worst_error / (kMargin * goal.accuracy), 1 / ErrorPower(rounds));
  }
  // A surface of long triangles is refined by halves: between them there is no mesh.
  const bool stuck =
      rounds.size() > 1 &&
      last.corner_node_count < kLeastGrowth * rounds[rounds.size() - 2].corner_node_count;
  if (stuck) growth = kMostGrowth;
  growth = std::min({growth, kMostGrowth, AffordableGrowth(goal, rounds),
                     kMaxMeshNodes / kNodesPerCorner / last.corner_node_count});
  if (growth < kLeastGrowth) return std::nullopt;
  return static_cast<int>(growth * last.corner_node_count);
}

}  // namespace carillon::precompute
