// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/decompose.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/fem/assembly.h"
#include "precompute/fem/curved_element.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/element_size.h"
#include "precompute/mesh/fill/midside_nodes.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/read/read_mesh.h"
#include "precompute/mesh/surface/prepare_surface.h"
#include "precompute/modes/audible_modes.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/spectra_check.h"
#include "precompute/pipeline/graded_size.h"
#include "precompute/pipeline/model_checks.h"
#include "precompute/pipeline/model_warnings.h"
#include "precompute/pipeline/phase_clock.h"
#include "precompute/pipeline/refined_check.h"
#include "precompute/pipeline/resolution.h"
#include "precompute/pipeline/solve_steps.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// The body to decompose, and the surface that its boundary refers to.
struct Body {
  SurfaceMesh given;
  TetMesh mesh;
  std::vector<std::string> warnings;
  double frequency_error = 0;  ///< estimated and relative, because its surface was coarsened
};

/// A surface that can be filled as finely as one likes.
struct Fillable {
  SurfaceMesh given;
  PreparedSurface prepared;
  MeshNames names;
};

/// Warns if the mesh has many more corner nodes than were asked for, because the surface forces
/// them.
void WarnOfMoreNodes(int asked, const TetMesh& mesh, std::vector<std::string>& warnings) {
  constexpr double kMany = 1.5;
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  std::vector<bool> is_corner(mesh.nodes.size(), false);
  for (size_t i = 0; i < mesh.elements.size(); ++i) {
    if (i % stride < 4) is_corner[static_cast<size_t>(mesh.elements[i])] = true;
  }
  const auto corner_count = std::ranges::count(is_corner, true);
  if (asked == 0 || static_cast<double>(corner_count) <= kMany * asked) return;
  warnings.push_back(absl::StrCat("the mesh has ", corner_count, " corner nodes, not the ", asked,
                                  " asked for (--nodes), because the surface forces them"));
}

absl::StatusOr<Body> FillSurface(const Fillable& surface, const MeshingSettings& meshing,
                                 const v1::WorkerRequest& request) {
  ASSIGN_OR_RETURN(TetMesh mesh, Tetrahedralize(surface.prepared.surface, meshing));
  for (BoundaryFace& face : mesh.boundary) {
    face.given_triangle = surface.prepared.given_triangle[static_cast<size_t>(face.given_triangle)];
  }
  RETURN_IF_ERROR(FixNodes(FixturesOf(request), surface.given, surface.names, mesh));
  std::vector<std::string> warnings = surface.prepared.warnings;
  const int asked = static_cast<int>(request.settings().mesh().target_node_count());
  if (meshing.target_node_count == asked) WarnOfMoreNodes(asked, mesh, warnings);
  return Body{surface.given, std::move(mesh), std::move(warnings),
              surface.prepared.frequency_error};
}

absl::StatusOr<Body> TakeTetrahedra(TetMesh mesh, const MeshNames& names,
                                    const v1::WorkerRequest& request) {
  const int nodes_per_element = MeshingOf(request).nodes_per_element;
  if (mesh.nodes_per_element > nodes_per_element) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        "the mesh has tetrahedra of ten nodes, which linear elements have no use for; ask "
        "for quadratic elements, or give a mesh of four-node tetrahedra");
  }
  RETURN_IF_ERROR(CheckCurvedElements(mesh));
  SurfaceMesh given = BoundarySurface(mesh);
  if (mesh.nodes_per_element < nodes_per_element) AddMidsideNodes(mesh);
  RETURN_IF_ERROR(FixNodes(FixturesOf(request), given, names, mesh));
  return Body{.given = std::move(given), .mesh = std::move(mesh), .warnings = {}};
}

/// Whether the surface may get other triangles. Fixtures can name vertices of the given ones.
bool MayCoarsen(const v1::WorkerRequest& request) {
  const v1::MeshSettings& mesh = request.settings().mesh();
  const std::vector<Fixture> fixtures = FixturesOf(request);
  return !mesh.has_keep_surface() && mesh.accuracy() == 0 &&
         std::ranges::none_of(fixtures, [](const Fixture& fixture) {
           return std::holds_alternative<FixedVertices>(fixture) ||
                  std::holds_alternative<FixedGroup>(fixture);
         });
}

/// Adds the diagonal of the box around a refused surface, metres, which remedies refer to.
absl::Status WithExtent(absl::Status refusal, const SurfaceMesh& surface) {
  if (surface.vertices.empty()) return refusal;
  AddFigure(refusal, "extent_m", absl::StrFormat("%.6g", Diagonal(surface.vertices)));
  return refusal;
}

/// Returns the diagonal of the box around a mesh, m.
double ExtentOf(const Mesh& mesh) {
  if (const auto* tetrahedra = std::get_if<TetMesh>(&mesh)) return Diagonal(tetrahedra->nodes);
  return Diagonal(std::get<SurfaceMesh>(mesh).vertices);
}

/// A surface to be filled, or a mesh of tetrahedra as it is.
using Input = std::variant<Fillable, Body>;

absl::StatusOr<Input> ReadInput(const std::string& bytes, const v1::WorkerRequest& request,
                                DecompositionObserver& observer) {
  observer.OnProgress(v1::PHASE_READ, 0);
  const v1::DecompositionSettings& settings = request.settings();
  ASSIGN_OR_RETURN(NamedMesh read,
                   ParseMesh(bytes, request.mesh_format(), settings.metres_per_unit()));
  const double extent_m = ExtentOf(read.mesh);
  observer.OnExtent(UseOf(request).size * extent_m);
  RETURN_IF_ERROR(CheckUnit(extent_m, settings.metres_per_unit(), UseOf(request)));
  observer.OnProgress(v1::PHASE_MESH, 0);
  if (auto* tetrahedra = std::get_if<TetMesh>(&read.mesh)) {
    ASSIGN_OR_RETURN(Body body, TakeTetrahedra(std::move(*tetrahedra), read.names, request));
    body.warnings = std::move(read.warnings);
    return body;
  }
  auto& given = std::get<SurfaceMesh>(read.mesh);
  absl::StatusOr<PreparedSurface> prepared =
      PrepareSurface(given, {.repair = settings.mesh().repair(),
                             .wall_m = settings.mesh().wall_m(),
                             .coarsen = MayCoarsen(request),
                             .most_triangles = 2 * settings.mesh().target_node_count()});
  if (!prepared.ok()) return WithExtent(prepared.status(), given);
  std::ranges::move(read.warnings, std::back_inserter(prepared->warnings));
  return Fillable{std::move(given), *std::move(prepared), std::move(read.names)};
}

/// The goal for a surface if nobody asked for another. Its processor time is the predicted one, so
/// that each machine makes the same model. The prediction for thin plates is about half the time
/// that they take.
constexpr ResolutionGoal kUsualGoal{.accuracy = kGreatError, .budget_s = kUsualMeans.cpu_s / 2};

SolveOptions OptionsOf(const v1::WorkerRequest& request, DecompositionObserver& observer) {
  const bool may_lower_band =
      UseOf(request).high_is_default && request.settings().keep_mode_count() == 0;
  return {.max_mode_count =
              request.settings().keep_mode_count() > 0 ? kMaxFoundModeCount : kMaxModeCount,
          .means = may_lower_band ? std::optional(kUsualMeans) : std::nullopt,
          .on_cost = [&observer](const SolveCost& cost) { observer.OnPlan(PlanOf(cost)); }};
}

absl::StatusOr<DeformationModes> FindModes(const SystemMatrices& system, const TetMesh& mesh,
                                           const v1::WorkerRequest& request,
                                           DecompositionObserver& observer) {
  const IntendedUse use = UseOf(request);
  return SolveDeformationModes(
      system, mesh, use.UnitEigenvalue(use.high_hz),
      [&](SolveStage stage, double done) { observer.OnProgress(PhaseOf(stage), done); },
      OptionsOf(request, observer));
}

/// A model, and the processor time that was predicted for it, which is the same on each machine.
struct Solved {
  ModalModel model;
  double predicted_cpu_s;
};

/// One body solved whole.
absl::StatusOr<Solved> Solve(const Body& body, const v1::WorkerRequest& request,
                             DecompositionObserver& observer) {
  const v1::DecompositionSettings& settings = request.settings();
  observer.OnMesh(body.mesh.nodes.size());
  observer.OnProgress(v1::PHASE_ASSEMBLE, 0);
  const ElasticConstants elastic{.young_pa = 1, .poisson_ratio = settings.poisson_ratio()};
  const SystemMatrices system = Assemble(body.mesh, elastic, 1, MassSharingOf(request));
  ASSIGN_OR_RETURN(const DeformationModes solution,
                   FindModes(system, body.mesh, request, observer));
  std::optional<SpectraCheck> check;
  if (settings.check_with() == v1::SOLVER_SPECTRA) {
    check = CheckWithSpectra(system, body.mesh, solution);
  }
  observer.OnProgress(v1::PHASE_WRITE, 0);
  ModalModel model = MakeModalModel(body.mesh, body.given, elastic, solution);
  model.warnings = body.warnings;
  for (double& error : model.estimated_errors) error += body.frequency_error;
  WarnOfLowerBand(solution, UseOf(request), Diagonal(body.mesh.nodes), model);
  if (check) model.warnings.push_back(check->Text());
  model.check = std::move(check);
  KeepMostAudible(static_cast<int>(settings.keep_mode_count()), model);
  return Solved{std::move(model), solution.predicted_cpu_s};
}

/// Whether the request leaves the fineness of the mesh to the program. Linear elements are left as
/// they are, because they serve comparisons.
bool IsFinenessFree(const v1::WorkerRequest& request) {
  const v1::MeshSettings& mesh = request.settings().mesh();
  return !GoalOf(request).given() && mesh.target_node_count() == 0 && !mesh.keep_surface() &&
         MeshingOf(request).nodes_per_element == 10;
}

/// Number of corner nodes of the mesh with which a mesh of few elements is compared.
constexpr int kReferenceCornerCount = 800;
/// Largest number of nodes of a mesh whose elements are divided for a comparison.
constexpr size_t kMostDividedNodes = 3000;

/// Compares the modes of a mesh of few elements with those of a mesh of ordinary elements: of the
/// surface, if the body has one that can be filled, or of the mesh's divided elements.
void CheckFewElements(const Body& body, const Fillable* surface, const v1::WorkerRequest& request,
                      ModalModel& model) {
  const bool can_compare =
      surface == nullptr ? body.mesh.nodes.size() <= kMostDividedNodes : !IsFinenessFree(request);
  if (!can_compare || !HasFewElements(body.mesh) || model.left_out_mode_count > 0) return;
  absl::StatusOr<Body> finer = absl::UnknownError("");
  if (surface != nullptr) {
    finer = FillSurface(*surface, {.target_node_count = kReferenceCornerCount}, request);
  }
  const ElasticConstants elastic{.young_pa = 1,
                                 .poisson_ratio = request.settings().poisson_ratio()};
  CompareWith(finer.ok() ? finer->mesh : Refined(body.mesh), elastic, MassSharingOf(request),
              model);
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
  return {.element_size_m = SurfaceElementSize(BoundarySurface(mesh)),
          .node_count = count,
          .uniform_node_count = count,
          .thin = nodes_per_corner * corners_on_boundary > kThin * count,
          .worst_error = model.eigenvalues.empty() ? model.lowest_error : model.WorstError(),
          .cpu_s = cpu_s,
          .peak_bytes = PeakBytes()};
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

/// Fills a surface. Where the graded mesh would have more than `most_node_count` nodes, which the
/// prediction can be wrong about for walls, the mesh becomes uniform.
absl::StatusOr<Body> FillGraded(const Fillable& surface, double most_node_count,
                                MeshingSettings& settings, const v1::WorkerRequest& request) {
  if (!settings.relative_size.is_uniform()) {
    settings.most_node_count = most_node_count;
    absl::StatusOr<Body> graded = FillSurface(surface, settings, request);
    settings.most_node_count = 0;
    const bool is_small =
        graded.ok() && static_cast<double>(graded->mesh.nodes.size()) <= most_node_count;
    if (is_small) return graded;
    settings.relative_size = {};
  }
  return FillSurface(surface, settings, request);
}

/// Returns the settings of the first mesh.
MeshingSettings FirstMeshing(const v1::WorkerRequest& request) {
  MeshingSettings meshing = MeshingOf(request);
  if (GoalOf(request).given() && meshing.target_node_count == 0) {
    meshing.target_node_count = kFirstCornerNodeCount;
  }
  return meshing;
}

/// Number of corner nodes of the mesh that shows whether a body is too small.
constexpr int kCoarseCornerCount = 300;

/// Returns a model without modes if a coarse mesh shows that the body is too small for the band, as
/// in a wrong unit.
std::optional<ModalModel> TooSmall(const Fillable& surface, const v1::WorkerRequest& request,
                                   DecompositionObserver& observer) {
  const IntendedUse use = UseOf(request);
  if (!IsFinenessFree(request) || !MayBeTooSmall(surface.prepared.surface, use)) {
    return std::nullopt;
  }
  const absl::StatusOr<Body> body =
      FillSurface(surface, {.target_node_count = kCoarseCornerCount}, request);
  if (!body.ok()) return std::nullopt;
  absl::StatusOr<Solved> solved = Solve(*body, request, observer);
  if (!solved.ok() || !IsSurelyAboveBand(solved->model, use)) return std::nullopt;
  return std::move(solved->model);
}

/// Fills and solves a surface finer and finer until the goal is met.
absl::StatusOr<ModalModel> SolveToGoal(const Fillable& surface, const v1::WorkerRequest& request,
                                       DecompositionObserver& observer) {
  const bool is_free = IsFinenessFree(request);
  const ResolutionGoal asked = GoalOf(request);
  MeshingSettings meshing = FirstMeshing(request);
  double most_node_count = 0;  // of a graded mesh
  std::vector<Round> rounds;
  RoundForecast forecast{.later_rounds = asked.given() ? kLaterRoundsAfterFirst : 0};
  absl::StatusOr<ModalModel> best = absl::UnknownError("");
  if (auto too_small = TooSmall(surface, request, observer)) return *std::move(too_small);
  while (true) {
    const PhaseClock::Times begun = PhaseClock::Now();
    observer.OnRound(forecast);
    observer.OnProgress(v1::PHASE_MESH, 0);
    const absl::StatusOr<Body> body = FillGraded(surface, most_node_count, meshing, request);
    // A finer mesh that cannot be made takes nothing from the coarser one.
    if (!body.ok()) return best.ok() ? std::move(best) : body.status();
    absl::StatusOr<Solved> solved = Solve(*body, request, observer);
    if (!solved.ok() && best.ok()) return best;
    if (!solved.ok()) return solved.status();
    CheckFewElements(*body, &surface, request, solved->model);
    if (IsSurelyAboveBand(solved->model, UseOf(request))) return std::move(solved->model);
    const PhaseClock::Times ended = PhaseClock::Now();
    rounds.push_back(
        Describe(body->mesh, solved->model,
                 is_free ? solved->predicted_cpu_s : ended.cpu_seconds - begun.cpu_seconds));
    if (!meshing.relative_size.is_uniform() && !SetEquivalentSize(meshing.element_size_m, rounds)) {
      rounds.pop_back();
      meshing.relative_size = {};
      continue;
    }
    const std::optional<double> next = NextElementSize(is_free ? kUsualGoal : asked, rounds);
    if (!next) return std::move(solved->model);
    best = std::move(solved->model);
    if (asked.given()) meshing.relative_size = Grade(body->mesh, *best, rounds.back(), *next);
    most_node_count = kMostOfUniform * UniformNodeCount(rounds.back(), *next);
    meshing.element_size_m = *next;
    forecast = {.expected_s = (ended.seconds - begun.seconds) * TimeGrowth(rounds.back(), *next),
                .later_rounds = kLaterRounds};
  }
}

absl::StatusOr<ModalModel> SolveInput(const Input& input, const v1::WorkerRequest& request,
                                      DecompositionObserver& observer) {
  const auto* surface = std::get_if<Fillable>(&input);
  if (surface != nullptr) return SolveToGoal(*surface, request, observer);
  const Body& body = std::get<Body>(input);
  ASSIGN_OR_RETURN(Solved solved, Solve(body, request, observer));
  CheckFewElements(body, nullptr, request, solved.model);
  return std::move(solved.model);
}

void WarnOfOverruns(const ResolutionGoal& goal, double used_s, ModalModel& model) {
  std::ranges::move(OverrunWarnings(goal, used_s, PeakBytes()), std::back_inserter(model.warnings));
}

}  // namespace

absl::StatusOr<ModalModel> Decompose(std::string mesh_bytes, const v1::WorkerRequest& request,
                                     DecompositionObserver& observer) {
  const double begun_cpu_s = PhaseClock::Now().cpu_seconds;
  ASSIGN_OR_RETURN(const Input input, ReadInput(std::exchange(mesh_bytes, {}), request, observer));
  ASSIGN_OR_RETURN(ModalModel model, SolveInput(input, request, observer));
  RETURN_IF_ERROR(CheckBand(model, UseOf(request)));
  WarnOfAccuracy(GoalOf(request), model);
  RETURN_IF_ERROR(
      LeaveOutInaccurate(request.settings().max_frequency_error(), UseOf(request), model));
  WarnOfGreatErrors(model);
  WarnOfOverruns(GoalOf(request), PhaseClock::Now().cpu_seconds - begun_cpu_s, model);
  WarnOfNodesBesideGoal(static_cast<int>(request.settings().mesh().target_node_count()),
                        GoalOf(request), model);
  observer.OnModes(model.eigenvalues.size());
  return model;
}

}  // namespace carillon::precompute
