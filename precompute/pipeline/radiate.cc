// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/radiate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "precompute/pipeline/intended_use.h"
#include "precompute/pipeline/worker_request.h"
#include "precompute/sparse/openblas.h"

namespace carillon::precompute {

double DefaultRadiationBudget(const ModalModel& model) {
  constexpr double kSecondsPerNodeAndMode = 3e-6;
  const double modes_s = kSecondsPerNodeAndMode * static_cast<double>(model.node_count) *
                         static_cast<double>(model.eigenvalues.size());
  return std::clamp(modes_s, 20.0, 600.0);
}

absl::StatusOr<Transfer> Radiate(const ModalModel& model, const worker::v1::WorkerRequest& request,
                                 DecompositionObserver& observer) {
  const IntendedUse use = UseOf(request);
  const Air air;
  const auto wavenumber = [&](double frequency_hz) {
    return 2 * std::numbers::pi * frequency_hz * use.size / air.sound_speed_m_per_s;
  };
  const double budget_s = request.transfer().budget_s();
  const RadiationSettings settings{
      .speed_ratio = std::sqrt(use.young_pa / use.density_kg_per_m3) / air.sound_speed_m_per_s,
      .air = air,
      .least_wavenumber = wavenumber(use.low_hz),
      .greatest_wavenumber = wavenumber(use.high_hz),
      .goal_db = request.transfer().accuracy_db(),
      .budget_cpu_s = budget_s > 0 ? budget_s : DefaultRadiationBudget(model),
      .thread_count = ThreadCount()};
  const SurfaceModes modes{.vertices = model.vertices,
                           .triangles = model.triangles,
                           .eigenvalues = model.eigenvalues,
                           .shapes = model.shapes,
                           .mass_moments = model.mass_moments};
  observer.OnRound({});
  observer.OnPlan({{.phase = v1::PHASE_RADIATE, .predicted_s = settings.budget_cpu_s}});
  observer.OnProgress(v1::PHASE_RADIATE, 0);
  return ComputeTransfer(modes, settings,
                         [&](double done) { observer.OnProgress(v1::PHASE_RADIATE, done); });
}

}  // namespace carillon::precompute
