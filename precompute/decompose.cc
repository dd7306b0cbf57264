// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/decompose.h"

#include <sys/resource.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/fem/assembly.h"
#include "precompute/fem/matrix_market.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/element_size.h"
#include "precompute/mesh/fill/midside_nodes.h"
#include "precompute/mesh/read/read_mesh.h"
#include "precompute/mesh/surface/prepare_surface.h"
#include "precompute/modes/audible_modes.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/phase_clock.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// The body to decompose, and the surface that its boundary refers to.
struct Body {
  SurfaceMesh given;
  TetMesh mesh;
  std::vector<std::string> warnings;
};

/// A surface that can be filled as finely as one likes.
struct Fillable {
  SurfaceMesh given;
  PreparedSurface prepared;
  MeshNames names;
};

absl::StatusOr<Body> FillSurface(const Fillable& surface, const DecompositionSettings& settings) {
  absl::StatusOr<TetMesh> mesh = Tetrahedralize(surface.prepared.surface, settings.meshing);
  if (!mesh.ok()) return mesh.status();
  for (BoundaryFace& face : mesh->boundary) {
    face.given_triangle = surface.prepared.given_triangle[static_cast<size_t>(face.given_triangle)];
  }
  absl::Status status = Hold(settings.fixtures, surface.given, surface.names, *mesh);
  if (!status.ok()) return status;
  return Body{surface.given, *std::move(mesh), surface.prepared.warnings};
}

absl::StatusOr<Body> TakeTetrahedra(TetMesh mesh, const MeshNames& names,
                                    const DecompositionSettings& settings) {
  const int nodes_per_element = settings.meshing.nodes_per_element;
  if (mesh.nodes_per_element > nodes_per_element) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        "the mesh has tetrahedra of ten nodes, which linear elements have no use for; ask "
        "for quadratic elements, or give a mesh of four-node tetrahedra");
  }
  SurfaceMesh given = BoundarySurface(mesh);
  if (mesh.nodes_per_element < nodes_per_element) AddMidsideNodes(mesh);
  absl::Status status = Hold(settings.fixtures, given, names, mesh);
  if (!status.ok()) return status;
  return Body{std::move(given), std::move(mesh), {}};
}

/// A surface to be filled, or a mesh of tetrahedra as it is.
using Input = std::variant<Fillable, Body>;

absl::StatusOr<Input> ReadInput(const MeshFile& file, const DecompositionSettings& settings,
                                DecompositionObserver& observer) {
  observer.OnProgress(Phase::kRead, 0);
  absl::StatusOr<NamedMesh> read = ReadMesh(file.path, file.format, file.metres_per_unit);
  if (!read.ok()) return read.status();
  observer.OnProgress(Phase::kMesh, 0);
  if (auto* tetrahedra = std::get_if<TetMesh>(&read->mesh)) {
    absl::StatusOr<Body> body = TakeTetrahedra(std::move(*tetrahedra), read->names, settings);
    if (!body.ok()) return body.status();
    return *std::move(body);
  }
  auto& given = std::get<SurfaceMesh>(read->mesh);
  absl::StatusOr<PreparedSurface> prepared = PrepareSurface(given, settings.preparation);
  if (!prepared.ok()) return prepared.status();
  return Fillable{std::move(given), *std::move(prepared), std::move(read->names)};
}

absl::Status SaveMatrices(const SystemMatrices& system, const DecompositionSettings& settings) {
  if (settings.matrices_folder.empty()) return absl::OkStatus();
  if (absl::Status status = WriteMatrixMarket(absl::StrCat(settings.matrices_folder, "/K.mtx"),
                                              system.K, settings.use.young_pa);
      !status.ok()) {
    return status;
  }
  return WriteMatrixMarket(absl::StrCat(settings.matrices_folder, "/M.mtx"), system.M,
                           settings.use.density_kg_per_m3);
}

Phase PhaseOf(SolveStage stage) {
  switch (stage) {
    case SolveStage::kFactor:
      return Phase::kFactor;
    case SolveStage::kSolve:
      return Phase::kSolve;
    case SolveStage::kVerify:
      return Phase::kVerify;
  }
  return Phase::kSolve;
}

absl::Status CheckBand(const ModalModel& model, const IntendedUse& use) {
  const double lowest = use.UnitEigenvalue(use.low_hz);
  if (std::ranges::any_of(model.eigenvalues, [&](double x) { return x >= lowest; })) {
    return absl::OkStatus();
  }
  const double first_hz = use.FrequencyHz(model.lowest_eigenvalue);
  absl::Status status =
      Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
              absl::StrFormat(
                  "no natural frequency of the body lies between %g and %g Hz, its first is "
                  "%.5g Hz; check the unit of the file, or choose another size, material or band",
                  use.low_hz, use.high_hz, first_hz));
  AddFigure(status, "first_mode_hz", absl::StrFormat("%.6g", first_hz));
  return status;
}

/// What takes time after the matrices.
std::vector<PlannedStep> PlanOf(const SolveCost& cost) {
  return {{.phase = Phase::kVerify, .predicted_s = cost.count_s},
          {.phase = Phase::kFactor, .predicted_s = cost.factor_s},
          {.phase = Phase::kSolve, .predicted_s = cost.solve_s},
          {.phase = Phase::kVerify, .predicted_s = cost.verify_s},
          {.phase = Phase::kWrite, .predicted_s = cost.model_s}};
}

SolveOptions OptionsOf(const DecompositionSettings& settings, DecompositionObserver& observer) {
  return {.max_mode_count = settings.keep_mode_count > 0 ? kMaxFoundModeCount : kMaxModeCount,
          .on_cost = [&observer](const SolveCost& cost) { observer.OnPlan(PlanOf(cost)); }};
}

/// One body solved whole.
absl::StatusOr<ModalModel> Solve(const Body& body, const DecompositionSettings& settings,
                                 DecompositionObserver& observer) {
  observer.OnMesh(body.mesh.nodes.size(), body.mesh.element_count());
  observer.OnProgress(Phase::kAssemble, 0);
  const ElasticConstants elastic{.young_pa = 1, .poisson_ratio = settings.poisson_ratio};
  const SystemMatrices system = Assemble(body.mesh, elastic, 1, settings.mass);
  if (absl::Status status = SaveMatrices(system, settings); !status.ok()) return status;

  const absl::StatusOr<DeformationModes> solution = SolveDeformationModes(
      system, body.mesh, settings.use.UnitEigenvalue(settings.use.high_hz),
      [&](SolveStage stage, double done) { observer.OnProgress(PhaseOf(stage), done); },
      OptionsOf(settings, observer));
  if (!solution.ok()) return solution.status();
  observer.OnProgress(Phase::kWrite, 0);
  ModalModel model = MakeModalModel(body.mesh, body.given, elastic, *solution);
  model.warnings = body.warnings;
  KeepMostAudible(settings.keep_mode_count, model);
  return model;
}

double PeakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

/// Part of the nodes on the boundary from which on a body is all wall.
constexpr double kThin = 0.8;
/// Nodes of a mesh of quadratic elements for each corner of it, in a wall.
constexpr double kNodesPerCorner = 6;

Round Describe(const TetMesh& mesh, const ModalModel& model, double cpu_s) {
  const double count = static_cast<double>(mesh.nodes.size());
  const double corners_on_boundary = static_cast<double>(mesh.boundary.size()) / 2;
  const double nodes_per_corner = mesh.nodes_per_element == 10 ? kNodesPerCorner : 1;
  return {.grain_m = Grain(BoundarySurface(mesh)),
          .node_count = count,
          .thin = nodes_per_corner * corners_on_boundary > kThin * count,
          .worst_error = model.WorstError(),
          .cpu_s = cpu_s,
          .peak_bytes = PeakBytes()};
}

/// Fills and solves a surface finer and finer until the goal is met.
absl::StatusOr<ModalModel> SolveToGoal(const Fillable& surface, DecompositionSettings settings,
                                       DecompositionObserver& observer) {
  MeshingSettings& meshing = settings.meshing;
  if (settings.resolution.given() && meshing.target_node_count == 0) {
    meshing.target_node_count = kFirstCornerNodeCount;
  }
  std::vector<Round> rounds;
  RoundForecast forecast{.later_rounds = settings.resolution.given() ? kLaterRoundsAfterFirst : 0};
  absl::StatusOr<ModalModel> best = absl::UnknownError("");
  while (true) {
    const PhaseClock::Times begun = PhaseClock::Now();
    observer.OnRound(forecast);
    observer.OnProgress(Phase::kMesh, 0);
    const absl::StatusOr<Body> body = FillSurface(surface, settings);
    // A finer mesh that cannot be had takes nothing from the coarser one.
    if (!body.ok() && best.ok()) return best;
    if (!body.ok()) return body.status();
    absl::StatusOr<ModalModel> model = Solve(*body, settings, observer);
    if (!model.ok() && best.ok()) return best;
    if (!model.ok() || !settings.resolution.given()) return model;
    const PhaseClock::Times ended = PhaseClock::Now();
    rounds.push_back(Describe(body->mesh, *model, ended.cpu_seconds - begun.cpu_seconds));
    const std::optional<double> next = NextGrain(settings.resolution, rounds);
    if (!next) return model;
    best = std::move(model);
    meshing.grain_m = *next;
    forecast = {.expected_s = (ended.seconds - begun.seconds) * TimeGrowth(rounds.back(), *next),
                .later_rounds = kLaterRounds};
  }
}

void WarnOfAccuracy(const ResolutionGoal& goal, ModalModel& model) {
  const double reached = model.WorstError();
  if (!(goal.accuracy > 0) || reached <= goal.accuracy) return;
  model.warnings.push_back(absl::StrFormat(
      "the accuracy of %.3g %% asked for was not reached: the worst mode is estimated to be off by "
      "%.3g %%; allow more time, memory or nodes, or a mesh that can be refined",
      100 * goal.accuracy, 100 * reached));
}

}  // namespace

absl::StatusOr<ModalModel> Decompose(const MeshFile& file, const DecompositionSettings& settings,
                                     DecompositionObserver& observer) {
  const double begun_cpu_s = PhaseClock::Now().cpu_seconds;
  const absl::StatusOr<Input> input = ReadInput(file, settings, observer);
  if (!input.ok()) return input.status();
  const auto* surface = std::get_if<Fillable>(&*input);
  absl::StatusOr<ModalModel> model = surface != nullptr
                                         ? SolveToGoal(*surface, settings, observer)
                                         : Solve(std::get<Body>(*input), settings, observer);
  if (!model.ok()) return model;
  if (absl::Status status = CheckBand(*model, settings.use); !status.ok()) return status;
  WarnOfAccuracy(settings.resolution, *model);
  const double used_s = PhaseClock::Now().cpu_seconds - begun_cpu_s;
  std::ranges::move(OverrunWarnings(settings.resolution, used_s, PeakBytes()),
                    std::back_inserter(model->warnings));
  observer.OnModes(model->eigenvalues.size());
  return model;
}

}  // namespace carillon::precompute
