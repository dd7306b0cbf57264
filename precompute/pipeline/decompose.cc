// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/decompose.h"

#include <utility>
#include <variant>

#include "precompute/pipeline/body.h"
#include "precompute/pipeline/model_checks.h"
#include "precompute/pipeline/model_warnings.h"
#include "precompute/pipeline/peak_memory.h"
#include "precompute/pipeline/phase_clock.h"
#include "precompute/pipeline/rounds.h"
#include "precompute/pipeline/solve_body.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Solves a surface in rounds, and a mesh of tetrahedra as it is.
absl::StatusOr<ModalModel> SolveInput(Input input, const worker::v1::WorkerRequest& request,
                                      DecompositionObserver& observer) {
  if (const auto* surface = std::get_if<Fillable>(&input)) {
    return Rounds(*surface, request, observer).Run();
  }
  ASSIGN_OR_RETURN(Solved solved, SolveBody(std::get<Body>(std::move(input)), request, observer));
  CheckFewElements(nullptr, request, solved);
  return std::move(solved.model);
}

/// Leaves out what the request does not want, and adds the warnings about the rest. Errors:
/// NO_MODE_IN_BAND, ACCURACY_NOT_REACHED.
absl::Status CheckModel(const worker::v1::WorkerRequest& request, double used_cpu_s,
                        ModalModel& model) {
  const IntendedUse use = UseOf(request);
  RETURN_IF_ERROR(CheckBand(model, use));
  WarnOfAccuracy(GoalOf(request), model);
  RETURN_IF_ERROR(LeaveOutInaccurate(request.settings().max_frequency_error(), use, model));
  WarnOfGreatErrors(model);
  WarnOfOverruns(GoalOf(request), used_cpu_s, PeakResidentBytes(), model);
  WarnOfNodesBesideGoal(static_cast<int>(request.settings().mesh().target_node_count()),
                        GoalOf(request), model);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ModalModel> Decompose(std::string mesh_bytes,
                                     const worker::v1::WorkerRequest& request,
                                     DecompositionObserver& observer) {
  const double begun_cpu_s = PhaseClock::Now().cpu_seconds;
  ASSIGN_OR_RETURN(Input input, ReadInput(std::exchange(mesh_bytes, {}), request, observer));
  ASSIGN_OR_RETURN(ModalModel model, SolveInput(std::move(input), request, observer));
  RETURN_IF_ERROR(CheckModel(request, PhaseClock::Now().cpu_seconds - begun_cpu_s, model));
  observer.OnModes(model.eigenvalues.size());
  return model;
}

}  // namespace carillon::precompute
