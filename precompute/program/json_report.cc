// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/json_report.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/region_properties.h"

namespace carillon::precompute {
namespace {

using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8, as in the name of a file, are replaced.
std::string Text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

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
  for (int k = v1::PHASE_READ; k <= v1::PHASE_RADIATE; ++k) {
    const auto phase = static_cast<v1::Phase>(k);
    const PhaseClock::Times& times = clock.Of(phase);
    phases.push_back({{"name", PhaseName(phase)},
                      {"seconds", times.seconds},
                      {"cpu_seconds", times.cpu_seconds}});
  }
  return phases;
}

/// For the material and size of `use`; see transfer.proto for the scaling.
Json Radiation(const ModeRadiation& mode, const Air& air, double omega, const IntendedUse& use) {
  if (!mode.computed) return {{"computed", false}};
  const double power_integral = mode.power_integral * use.size / use.density_kg_per_m3;
  return {{"computed", true},
          {"efficiency", mode.efficiency()},
          {"decay_rate_per_s", mode.DecayRatePerS(air) / (use.density_kg_per_m3 * use.size)},
          // Pa at 1 m for a modal displacement of 1 m kg^(1/2), peaks.
          {"pressure_at_1m_pa", air.density_kg_per_m3 * omega * omega *
                                    std::sqrt(power_integral / (4 * std::numbers::pi))},
          {"power_error_db", mode.power_error_db},
          {"direction_error_db", mode.direction_error_db},
          {"order", mode.order},
          {"harmonics", mode.index.size()},
          {"vertices", mode.vertex_count},
          {"edge_m", mode.edge_m},
          {"iterations", mode.iterations},
          {"residual", mode.residual},
          {"surface_power_db", mode.surface_power_db}};
}

/// The figures hold for unit density and the size of the mesh.
Json RigidBody(const RigidRadiation& rigid) {
  Json motions = Json::array();
  for (const RigidRadiation::Motion& motion : rigid.motions) {
    motions.push_back({{"radius_m", motion.radius_m},
                       {"strengths", motion.strengths},
                       {"error_db", motion.error_db}});
  }
  return {{"volume_m3", rigid.mass.volume_m3},
          {"center_of_mass_m", rigid.mass.center_of_mass},
          {"inertia_kg_m2", rigid.mass.inertia},
          {"wavenumbers", rigid.wavenumbers},
          {"motions", motions}};
}

Json RadiationSummary(const Transfer& transfer) {
  return {{"speed_ratio", transfer.settings.speed_ratio},
          {"center_m", transfer.center},
          {"radius_m", transfer.radius_m},
          {"cpu_seconds", transfer.cpu_s},
          {"accuracy_db", transfer.settings.goal_db},
          {"budget_s", transfer.settings.budget_cpu_s},
          {"rigid_body", RigidBody(transfer.rigid)},
          {"modes_wanted", std::ranges::count_if(transfer.modes, &ModeRadiation::in_band)},
          {"modes_computed", std::ranges::count_if(transfer.modes, &ModeRadiation::computed)}};
}

/// Returns the decay rate that the damping of the material, or of the materials of all regions,
/// gives a mode, 1/s.
double DecayRatePerS(const ModalModel& model, size_t m, const IntendedUse& use) {
  if (model.regions.empty()) return use.DecayRatePerS(model.eigenvalues[m]);
  double rate = 0;
  for (const ModelRegion& region : model.regions) {
    rate += RegionDecayRatePerS(*FindRegion(use.material, region.material.region),
                                use.FrequencyHz(model.eigenvalues[m]), region.strain_parts[m],
                                region.kinetic_parts[m]);
  }
  return rate;
}

Json ModesInBand(const ModalModel& model, const Transfer* transfer, const IntendedUse& use) {
  Json modes = Json::array();
  for (size_t m = 0; m < model.eigenvalues.size(); ++m) {
    const double eigenvalue = model.eigenvalues[m];
    if (eigenvalue < use.UnitEigenvalue(use.low_hz)) continue;
    const double decay_per_s = DecayRatePerS(model, m, use);
    modes.push_back({{"frequency_hz", use.FrequencyHz(eigenvalue)},
                     {"damped_frequency_hz", use.DampedFrequencyHz(eigenvalue, decay_per_s)},
                     {"decay_rate_per_s", decay_per_s},
                     {"residual", model.residuals[m]},
                     {"estimated_error", model.estimated_errors[m]}});
    if (transfer == nullptr) continue;
    const double omega = std::sqrt(std::max(0.0, use.Eigenvalue(eigenvalue)));
    // c' = c E^(1/2) rho^-1 size^-(1/2), as modal_model.proto says.
    modes.back()["coupling"] =
        model.couplings[m] * std::sqrt(use.young_pa / use.size) / use.density_kg_per_m3;
    modes.back()["radiation"] = Radiation(transfer->modes[m], transfer->settings.air, omega, use);
  }
  return modes;
}

/// The body that sounds, from which a wrong unit can be seen at once.
Json BodyOf(const ModalModel& model, const IntendedUse& use) {
  std::array<float, 3> low = model.vertices.front(), high = low;
  for (const auto& vertex : model.vertices) {
    for (size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], vertex[i]);
      high[i] = std::max(high[i], vertex[i]);
    }
  }
  Json extent_m = Json::array();
  for (size_t i = 0; i < 3; ++i) extent_m.push_back(use.size * (double{high[i]} - double{low[i]}));
  const double volume_m3 = model.volume_m3 * std::pow(use.size, 3);
  const double unit_mass = model.mass_moments.empty() ? model.volume_m3 : model.mass_moments[0];
  return {{"mass_kg", use.density_kg_per_m3 * unit_mass * std::pow(use.size, 3)},
          {"volume_m3", volume_m3},
          {"extent_m", extent_m}};
}

/// The results of the checks that every model has passed.
Json Verified(const Verification& verification, const IntendedUse& use) {
  return {{"largest_residual", verification.max_residual},
          {"largest_orthogonality_error", verification.max_orthogonality_error},
          {"rigid_body_modes", verification.rigid_mode_count},
          {"counted_eigenvalues", verification.sturm_count},
          {"counted_below_hz", use.FrequencyHz(verification.sturm_eigenvalue)}};
}

Json Check(const SpectraCheck& check) {
  if (!check.failure.empty()) return {{"solver", "Spectra"}, {"failure", check.failure}};
  return {{"solver", "Spectra"},
          {"mode_count", check.spectra_mode_count},
          {"largest_frequency_difference", check.largest_frequency_difference},
          {"least_mac", check.least_mac}};
}

}  // namespace

std::string JsonReport(const ModalModel& model, const Transfer* transfer, const IntendedUse& use,
                       const ProgressReporter& reporter) {
  Json report = {{"nodes", model.node_count},
                 {"elements", model.element_count},
                 {"unknowns", 3 * int64_t{model.node_count}},
                 {"peak_memory_bytes", PeakMemoryBytes()},
                 {"phases", PhaseTimes(reporter.clock())},
                 {"left_out_modes", model.left_out_mode_count},
                 {"complete_to_hz", use.FrequencyHz(model.complete_to_eigenvalue)},
                 {"lowered_from_modes", model.lowered_from_mode_count},
                 {"accuracy", model.WorstError()},
                 {"body", BodyOf(model, use)},
                 {"verification", Verified(model.verification, use)},
                 {"warnings", model.warnings},
                 {"modes", ModesInBand(model, transfer, use)}};
  if (model.check) report["check"] = Check(*model.check);
  if (transfer != nullptr) report["radiation"] = RadiationSummary(*transfer);
  return Text(report);
}

std::string JsonError(const absl::Status& status) {
  const v1::ErrorInfo error = ToErrorInfo(status);
  Json object = {{"reason", error.reason()}, {"message", error.message()}};
  for (const auto& [name, value] : error.metadata()) object["figures"][name] = value;
  for (const v1::Remedy& remedy : error.remedies()) {
    object["remedies"].push_back({{"field", remedy.field()},
                                  {"value", remedy.value()},
                                  {"option", remedy.option()},
                                  {"effect", remedy.effect()}});
  }
  return Text({{"error", object}});
}

}  // namespace carillon::precompute
