// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/rounds.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/element_size.h"
#include "precompute/pipeline/graded_size.h"
#include "precompute/pipeline/model_checks.h"
#include "precompute/pipeline/peak_memory.h"
#include "precompute/pipeline/usual_goal.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Part of the nodes on the boundary from which on a body is all wall.
constexpr double kThin = 0.8;
/// Nodes of a mesh of quadratic elements for each corner of it, in a wall.
constexpr double kNodesPerCorner = 6;

Round Describe(const TetMesh& mesh, const ModalModel& model, double cpu_s) {
  const double count = static_cast<double>(mesh.nodes.size());
  const double corners_on_boundary = static_cast<double>(mesh.boundary.size()) / 2;
  const double nodes_per_corner = mesh.nodes_per_element == 10 ? kNodesPerCorner : 1;
  return {.element_size_m = SurfaceElementSize(BoundarySurface(mesh)),
          .node_count = count,
          .uniform_node_count = count,
          .thin = nodes_per_corner * corners_on_boundary > kThin * count,
          .worst_error = model.eigenvalues.empty() ? model.lowest_error : model.WorstError(),
          .cpu_s = cpu_s,
          .peak_bytes = PeakResidentBytes()};
}

/// Returns the element sizes of the mesh after `last`, with which it has the error of a uniform
/// mesh of the size `next_m`.
SizeField Grade(const TetMesh& mesh, const ModalModel& model, const Round& last, double next_m) {
  return GradedSize(mesh, model.error_at_node,
                    {.element_size_m = last.element_size_m,
                     .next_element_size_m = next_m,
                     .dimension = Dimension(last),
                     .node_growth = UniformNodeCount(last, next_m) / last.node_count});
}

/// A graded mesh is used only if it has at most this part of the nodes of the uniform mesh.
constexpr double kMostOfUniform = 0.9;

/// Returns the settings of the first mesh.
MeshingSettings FirstMeshing(const worker::v1::WorkerRequest& request) {
  MeshingSettings meshing = MeshingOf(request);
  if (GoalOf(request).given() && meshing.target_node_count == 0) {
    meshing.target_node_count = kFirstCornerNodeCount;
  }
  return meshing;
}

/// Number of corner nodes of the mesh that shows whether a body is too small.
constexpr int kCoarseCornerCount = 300;

}  // namespace

Rounds::Rounds(const Fillable& surface, const worker::v1::WorkerRequest& request,
               DecompositionObserver& observer)
    : surface_(surface),
      request_(request),
      observer_(observer),
      is_free_(IsFinenessFree(request)),
      asked_(GoalOf(request)),
      meshing_(FirstMeshing(request)),
      forecast_{.later_rounds = asked_.given() ? kLaterRoundsAfterFirst : 0} {}

absl::StatusOr<ModalModel> Rounds::Run() {
  if (std::optional<ModalModel> too_small = TooSmall()) return *std::move(too_small);
  absl::StatusOr<ModalModel> best = absl::UnknownError("");
  for (Next next = Next::kFinerMesh; next != Next::kNothing;) {
    absl::StatusOr<Solved> solved = SolveNext();
    // A finer mesh that cannot be made or solved takes nothing from the coarser one.
    if (!solved.ok()) return best.ok() ? std::move(best) : solved.status();
    next = Plan(*solved);
    if (next != Next::kUniformMesh) best = std::move(solved->model);
  }
  return best;
}

// A model without modes if a coarse mesh shows that the body is too small for the band, as in a
// wrong unit.
std::optional<ModalModel> Rounds::TooSmall() const {
  const IntendedUse use = UseOf(request_);
  if (!is_free_ || !MayBeTooSmall(surface_.prepared.surface, use)) return std::nullopt;
  absl::StatusOr<Body> body = Fill(surface_, {.target_node_count = kCoarseCornerCount}, request_);
  if (!body.ok()) return std::nullopt;
  absl::StatusOr<Solved> solved = SolveBody(*std::move(body), request_, observer_);
  if (!solved.ok() || !IsSurelyAboveBand(solved->model, use)) return std::nullopt;
  return std::move(solved->model);
}

absl::StatusOr<Solved> Rounds::SolveNext() {
  begun_ = PhaseClock::Now();
  observer_.OnRound(forecast_);
  observer_.OnProgress(v1::PHASE_MESH, 0);
  ASSIGN_OR_RETURN(Body body, Fill(surface_, meshing_, request_));
  ASSIGN_OR_RETURN(Solved solved, SolveBody(std::move(body), request_, observer_));
  CheckFewElements(&surface_, request_, solved);
  return solved;
}

// What to do after a round, with the size and the forecast of the next one.
Rounds::Next Rounds::Plan(const Solved& solved) {
  const auto& [body, model, predicted_cpu_s] = solved;
  if (IsSurelyAboveBand(model, UseOf(request_))) return Next::kNothing;
  const PhaseClock::Times ended = PhaseClock::Now();
  rounds_.push_back(Describe(body.mesh, model,
                             is_free_ ? predicted_cpu_s : ended.cpu_seconds - begun_.cpu_seconds));
  if (body.graded && !SetEquivalentSize(meshing_.element_size_m, rounds_)) {
    rounds_.pop_back();
    meshing_.relative_size = {};
    return Next::kUniformMesh;
  }
  const Round& last = rounds_.back();
  const ResolutionGoal& goal = is_free_ ? kUsualGoal : asked_;
  const std::optional<double> size_m = NextElementSize(goal, rounds_);
  if (!size_m) return Next::kNothing;
  meshing_.relative_size = asked_.given() ? Grade(body.mesh, model, last, *size_m) : SizeField();
  meshing_.most_node_count = kMostOfUniform * UniformNodeCount(last, *size_m);
  meshing_.element_size_m = *size_m;
  forecast_ = {.expected_s = (ended.seconds - begun_.seconds) * TimeGrowth(last, *size_m),
               .later_rounds = LaterRounds(goal, rounds_)};
  return Next::kFinerMesh;
}

}  // namespace carillon::precompute
