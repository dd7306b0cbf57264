// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/model_warnings.h"

#include <algorithm>
#include <iterator>
#include <string>

#include "absl/strings/str_format.h"
#include "precompute/pipeline/usual_goal.h"

namespace carillon::precompute {

void WarnOfLowerBand(const DeformationModes& solution, const IntendedUse& use, double extent_m,
                     ModalModel& model) {
  if (solution.mode_count_below_asked == 0) return;
  const double complete_hz = use.FrequencyHz(solution.complete_to_eigenvalue);
  // A request for more modes than a model may hold would be refused.
  const std::string more =
      solution.mode_count_below_asked <= kMaxModeCount
          ? absl::StrFormat("ask for that band (--band %g:%g) to have them all", use.low_hz,
                            use.high_hz)
          : absl::StrFormat("a higher band (--band) may have at most %d modes", kMaxModeCount);
  // A larger expected number is not stored.
  const char* const about =
      solution.mode_count_below_asked > 0.99 * kMostExpectedModes ? "more than" : "some";
  model.warnings.push_back(absl::StrFormat(
      "only the %d modes below %.5g Hz were computed, because all of %s %d below %g Hz would "
      "need more than %d GiB or %g s of processor time; if the body is not %.3g m long, state the "
      "unit of its file (--unit); %s, or keep the most audible of them (--keep)",
      model.eigenvalues.size(), complete_hz, about, solution.mode_count_below_asked, use.high_hz,
      kUsualMeans.bytes >> 30U, kUsualMeans.cpu_s, use.size * extent_m, more));
}

void WarnOfOverruns(const ResolutionGoal& goal, double used_s, double used_bytes,
                    ModalModel& model) {
  std::ranges::move(OverrunWarnings(goal, used_s, used_bytes), std::back_inserter(model.warnings));
}

void WarnOfGreatErrors(ModalModel& model) {
  const auto many = std::ranges::count_if(model.estimated_errors,
                                          [](double error) { return error > kGreatError; });
  if (many == 0) return;
  model.warnings.push_back(absl::StrFormat(
      "very inaccurate: the frequencies of %d of %d modes are estimated to be off by more than "
      "%g %%, the worst by %.3g %%; ask for a finer mesh (--accuracy, --budget or --nodes), or "
      "leave these modes out (--max-frequency-error)",
      many, model.eigenvalues.size(), 100 * kGreatError, 100 * model.WorstError()));
}

void WarnOfNodesBesideGoal(int asked_corner_count, const ResolutionGoal& goal, ModalModel& model) {
  if (asked_corner_count == 0 || !goal.given()) return;
  model.warnings.push_back(absl::StrFormat(
      "the %d nodes asked for (--nodes, target_node_count) are those of the first mesh only; the "
      "accuracy or the budget decides how fine the last one is",
      asked_corner_count));
}

void WarnOfAccuracy(const ResolutionGoal& goal, ModalModel& model) {
  const double reached = model.WorstError();
  if (!(goal.accuracy > 0) || reached <= goal.accuracy) return;
  model.warnings.push_back(absl::StrFormat(
      "the accuracy of %.3g %% asked for was not reached: the worst mode is estimated to be off by "
      "%.3g %%; allow more time, memory or nodes, or a mesh that can be refined",
      100 * goal.accuracy, 100 * reached));
}

}  // namespace carillon::precompute
