// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/solve_body.h"

#include <optional>
#include <utility>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/point_math.h"
#include "precompute/modes/audible_modes.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/spectra_check.h"
#include "precompute/pipeline/model_warnings.h"
#include "precompute/pipeline/refined_check.h"
#include "precompute/pipeline/solve_steps.h"
#include "precompute/pipeline/usual_goal.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

SolveOptions OptionsOf(const worker::v1::WorkerRequest& request, DecompositionObserver& observer) {
  const bool may_lower_band =
      UseOf(request).high_is_default && request.settings().keep_mode_count() == 0;
  return {.max_mode_count =
              request.settings().keep_mode_count() > 0 ? kMaxFoundModeCount : kMaxModeCount,
          .means = may_lower_band ? std::optional(kUsualMeans) : std::nullopt,
          .on_cost = [&observer](const SolveCost& cost) { observer.OnPlan(PlanOf(cost)); }};
}

absl::StatusOr<DeformationModes> FindModes(const SystemMatrices& system, const TetMesh& mesh,
                                           const worker::v1::WorkerRequest& request,
                                           DecompositionObserver& observer) {
  const IntendedUse use = UseOf(request);
  return SolveDeformationModes(
      system, mesh, use.UnitEigenvalue(use.high_hz),
      [&](SolveStage stage, double done) { observer.OnProgress(PhaseOf(stage), done); },
      OptionsOf(request, observer));
}

/// The model of a solved body, with what is to be said about it so far.
ModalModel MakeModel(const Body& body, const SystemMatrices& system,
                     const DeformationModes& solution, const worker::v1::WorkerRequest& request) {
  const v1::DecompositionSettings& settings = request.settings();
  std::optional<SpectraCheck> check;
  if (settings.check_with() == v1::SOLVER_SPECTRA) {
    check = CheckWithSpectra(system, body.mesh, solution);
  }
  ModalModel model = MakeModalModel(body.mesh, body.given, body.materials, solution);
  model.warnings = body.warnings;
  for (double& error : model.estimated_errors) error += body.frequency_error;
  WarnOfLowerBand(solution, UseOf(request), Diagonal(body.mesh.nodes), model);
  if (check) model.warnings.push_back(check->Text());
  model.check = std::move(check);
  KeepMostAudible(static_cast<int>(settings.keep_mode_count()), model);
  return model;
}

/// Number of corner nodes of the mesh with which a mesh of few elements is compared.
constexpr int kReferenceCornerCount = 800;
/// Largest number of nodes of a mesh whose elements are divided for a comparison.
constexpr size_t kMostDividedNodes = 3000;

}  // namespace

bool IsFinenessFree(const worker::v1::WorkerRequest& request) {
  const v1::MeshSettings& mesh = request.settings().mesh();
  return !GoalOf(request).given() && mesh.target_node_count() == 0 && !mesh.keep_surface() &&
         MeshingOf(request).nodes_per_element == 10;
}

absl::StatusOr<Solved> SolveBody(Body body, const worker::v1::WorkerRequest& request,
                                 DecompositionObserver& observer) {
  observer.OnMesh(body.mesh.nodes.size());
  observer.OnProgress(v1::PHASE_ASSEMBLE, 0);
  const SystemMatrices system = Assemble(body.mesh, body.materials, MassSharingOf(request));
  ASSIGN_OR_RETURN(const DeformationModes modes, FindModes(system, body.mesh, request, observer));
  observer.OnProgress(v1::PHASE_WRITE, 0);
  ModalModel model = MakeModel(body, system, modes, request);
  return Solved{std::move(body), std::move(model), modes.predicted_cpu_s};
}

void CheckFewElements(const Fillable* surface, const worker::v1::WorkerRequest& request,
                      Solved& solved) {
  auto& [body, model, predicted_cpu_s] = solved;
  const bool can_compare =
      surface == nullptr ? body.mesh.nodes.size() <= kMostDividedNodes : !IsFinenessFree(request);
  if (!can_compare || !HasFewElements(body.mesh) || model.left_out_mode_count > 0) return;
  absl::StatusOr<Body> finer = absl::UnknownError("");
  if (surface != nullptr) {
    finer = Fill(*surface, {.target_node_count = kReferenceCornerCount}, request);
  }
  CompareWith(finer.ok() ? finer->mesh : Refined(body.mesh), body.materials, MassSharingOf(request),
              model);
}

}  // namespace carillon::precompute
