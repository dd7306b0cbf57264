// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"
#include "precompute/mesh/mesh_limits.h"

namespace carillon::precompute {
namespace {

/// Power of the element size to which the frequency error is proportional: four in the limit of
/// quadratic elements, less where walls are thin and elements as long as they are thick.
constexpr double kErrorPower = 2.4, kLeastErrorPower = 1.5, kMostErrorPower = 4;
constexpr double kTimePower = 1.6, kMemoryPower = 1.4;
/// Power of the node count for walls, whose factor has little fill-in: measured on a bowl of 18,000
/// and 100,000 nodes.
constexpr double kThinTimePower = 1.1;
/// Fraction of the accuracy and the budgets to aim for, so that one more round rarely is necessary.
constexpr double kMargin = 0.8;
/// Growth of the number of nodes from one round to the next.
constexpr double kLeastGrowth = 1.15, kMostGrowth = 6;
constexpr size_t kMostRounds = 6;
/// Ratio of the element sizes of two rounds above which the mesh counts as not refined.
constexpr double kSameSize = 0.97;
/// Ratio of the numbers of nodes of a graded mesh and the one before, up to which the graded mesh
/// counts as not refined.
constexpr double kSameNodeCount = 1.03;

double ErrorPower(const std::vector<Round>& rounds) {
  if (rounds.size() < 2) return kErrorPower;
  const Round& last = rounds.back();
  const Round& before = rounds[rounds.size() - 2];
  if (before.worst_error == 0 || last.worst_error == 0) return kErrorPower;
  const double power = std::log(before.worst_error / last.worst_error) /
                       std::log(before.element_size_m / last.element_size_m);
  return std::clamp(power, kLeastErrorPower, kMostErrorPower);
}

/// The factor by which the nodes may grow before the budget is used up.
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

/// The factor by which the nodes must grow before the accuracy is reached.
double NecessaryGrowth(const ResolutionGoal& goal, const std::vector<Round>& rounds) {
  const Round& last = rounds.back();
  if (goal.accuracy == 0 || last.worst_error == 0) return std::numeric_limits<double>::infinity();
  const double finer =
      std::pow(last.worst_error / (kMargin * goal.accuracy), 1 / ErrorPower(rounds));
  return std::pow(finer, Dimension(last));
}

/// The factor by which the nodes grow in this many rounds.
double Growth(const ResolutionGoal& goal, const std::vector<Round>& rounds, size_t count) {
  return std::min({std::pow(kMostGrowth, static_cast<double>(count)),
                   AffordableGrowth(goal, rounds), kMaxMeshNodes / rounds.back().node_count,
                   NecessaryGrowth(goal, rounds)});
}

bool Refined(const std::vector<Round>& rounds) {
  return rounds.size() < 2 ||
         rounds.back().element_size_m < kSameSize * rounds[rounds.size() - 2].element_size_m;
}

std::string Overrun(const char* what, double asked, double used) {
  return absl::StrFormat(
      "the budget of %.3g %s was overrun: %.3g were used; ask for fewer nodes, linear elements or "
      "a "
      "lower band, or allow more",
      asked, what, used);
}

}  // namespace

double Dimension(const Round& round) { return round.thin ? 2 : 3; }

bool SetEquivalentSize(double asked_m, std::vector<Round>& rounds) {
  Round& last = rounds.back();
  const Round& before = rounds[rounds.size() - 2];
  last.element_size_m = asked_m;
  last.uniform_node_count = UniformNodeCount(before, asked_m);
  return last.node_count > kSameNodeCount * before.node_count ||
         last.worst_error < before.worst_error / kSameNodeCount;
}

double UniformNodeCount(const Round& last, double element_size_m) {
  return last.uniform_node_count * std::pow(last.element_size_m / element_size_m, Dimension(last));
}

double TimeGrowth(const Round& last, double element_size_m) {
  const double nodes = std::pow(last.element_size_m / element_size_m, Dimension(last));
  return std::pow(nodes, last.thin ? kThinTimePower : kTimePower);
}

std::optional<double> NextElementSize(const ResolutionGoal& goal,
                                      const std::vector<Round>& rounds) {
  const Round& last = rounds.back();
  if (!goal.given() || rounds.size() >= kMostRounds || !Refined(rounds)) return std::nullopt;
  if (goal.accuracy > 0 && last.worst_error > 0 && last.worst_error <= goal.accuracy) {
    return std::nullopt;
  }
  const double growth = Growth(goal, rounds, 1);
  if (growth < kLeastGrowth) return std::nullopt;
  return last.element_size_m * std::pow(growth, -1 / Dimension(last));
}

double LaterRounds(const ResolutionGoal& goal, const std::vector<Round>& rounds) {
  const double next = Growth(goal, rounds, 1);
  const double all = Growth(goal, rounds, kMostRounds - rounds.size());
  if (all < kLeastGrowth * next) return kLaterRounds;
  return std::pow(all / next, rounds.back().thin ? kThinTimePower : kTimePower);
}

std::vector<std::string> OverrunWarnings(const ResolutionGoal& goal, double used_s,
                                         double used_bytes) {
  constexpr double kGib = 1024.0 * 1024 * 1024;
  std::vector<std::string> warnings;
  if (goal.budget_s > 0 && used_s > goal.budget_s) {
    warnings.push_back(Overrun("s of processor time", goal.budget_s, used_s));
  }
  if (goal.budget_bytes > 0 && used_bytes > goal.budget_bytes) {
    warnings.push_back(Overrun("GiB of memory", goal.budget_bytes / kGib, used_bytes / kGib));
  }
  return warnings;
}

}  // namespace carillon::precompute
