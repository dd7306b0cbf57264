// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/json_report.h"

#include <sys/resource.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

using Json = nlohmann::ordered_json;

/// Largest resident size so far of this process or of a child of it.
int64_t PeakMemoryBytes() {
  rusage own{};
  rusage children{};
  getrusage(RUSAGE_SELF, &own);
  getrusage(RUSAGE_CHILDREN, &children);
  return 1024 * int64_t{std::max(own.ru_maxrss, children.ru_maxrss)};  // given in KiB
}

Json PhaseTimes(const PhaseClock& clock) {
  Json phases = Json::array();
  for (int k = v1::PHASE_READ; k <= v1::PHASE_WRITE; ++k) {
    const auto phase = static_cast<v1::Phase>(k);
    const PhaseClock::Times& times = clock.Of(phase);
    phases.push_back({{"name", PhaseName(phase)},
                      {"seconds", times.seconds},
                      {"cpu_seconds", times.cpu_seconds}});
  }
  return phases;
}

Json ModesInBand(const ModalModel& model, const IntendedUse& use) {
  Json modes = Json::array();
  for (size_t m = 0; m < model.eigenvalues.size(); ++m) {
    const double eigenvalue = model.eigenvalues[m];
    if (eigenvalue < use.UnitEigenvalue(use.low_hz)) continue;
    modes.push_back({{"frequency_hz", use.FrequencyHz(eigenvalue)},
                     {"damped_frequency_hz", use.DampedFrequencyHz(eigenvalue)},
                     {"decay_rate_per_s", use.DecayRatePerS(eigenvalue)},
                     {"residual", model.residuals[m]},
                     {"estimated_error", model.estimated_errors[m]}});
  }
  return modes;
}

Json Check(const SolverComparison& comparison) {
  if (!comparison.failure.empty()) {
    return {{"solver", comparison.solver}, {"failure", comparison.failure}};
  }
  return {{"solver", comparison.solver},
          {"mode_count", comparison.other_mode_count},
          {"largest_frequency_difference", comparison.largest_frequency_difference},
          {"least_mac", comparison.least_mac}};
}

}  // namespace

std::string JsonReport(const ModalModel& model, const IntendedUse& use,
                       const ProgressReporter& reporter) {
  Json report = {{"nodes", model.node_count},
                 {"elements", model.element_count},
                 {"unknowns", 3 * int64_t{model.node_count}},
                 {"peak_memory_bytes", PeakMemoryBytes()},
                 {"phases", PhaseTimes(reporter.clock())},
                 {"left_out_modes", model.left_out_mode_count},
                 {"accuracy", model.WorstError()},
                 {"warnings", model.warnings},
                 {"modes", ModesInBand(model, use)}};
  if (model.comparison) report["check"] = Check(*model.comparison);
  return report.dump(2);
}

std::string JsonError(const absl::Status& status) {
  const v1::ErrorInfo error = ToErrorInfo(status);
  Json object = {{"reason", error.reason()}, {"message", error.message()}};
  for (const auto& [name, value] : error.metadata()) object["figures"][name] = value;
  return Json{{"error", object}}.dump(2);
}

}  // namespace carillon::precompute
