// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/decompose.h"

#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/fem/assembly.h"
#include "precompute/fem/matrix_market.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/midside_nodes.h"
#include "precompute/mesh/prepare_surface.h"
#include "precompute/mesh/read_mesh.h"
#include "precompute/modes/deformation_modes.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

/// The body to decompose, and the surface that its boundary refers to.
struct Body {
  SurfaceMesh given;
  TetMesh mesh;
  std::vector<std::string> warnings;
};

absl::StatusOr<Body> FillSurface(SurfaceMesh given, const DecompositionSettings& settings) {
  absl::StatusOr<PreparedSurface> prepared = PrepareSurface(given, settings.preparation);
  if (!prepared.ok()) return prepared.status();
  absl::StatusOr<TetMesh> mesh = Tetrahedralize(prepared->surface, settings.meshing);
  if (!mesh.ok()) return mesh.status();
  for (BoundaryFace& face : mesh->boundary) {
    face.given_triangle = prepared->given_triangle[static_cast<size_t>(face.given_triangle)];
  }
  return Body{std::move(given), *std::move(mesh), std::move(prepared->warnings)};
}

absl::StatusOr<Body> TakeTetrahedra(TetMesh mesh, int nodes_per_element) {
  if (mesh.nodes_per_element > nodes_per_element) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        "the mesh has tetrahedra of ten nodes, which linear elements have no use for; ask "
        "for quadratic elements, or give a mesh of four-node tetrahedra");
  }
  SurfaceMesh given = BoundarySurface(mesh);
  if (mesh.nodes_per_element < nodes_per_element) AddMidsideNodes(mesh);
  return Body{std::move(given), std::move(mesh), {}};
}

absl::StatusOr<Body> ReadBody(const MeshFile& file, const DecompositionSettings& settings,
                              DecompositionObserver& observer) {
  observer.OnProgress(Phase::kRead, 0);
  absl::StatusOr<Mesh> mesh = ReadMesh(file.path, file.format, file.metres_per_unit);
  if (!mesh.ok()) return mesh.status();
  observer.OnProgress(Phase::kMesh, 0);
  if (auto* tetrahedra = std::get_if<TetMesh>(&*mesh)) {
    return TakeTetrahedra(std::move(*tetrahedra), settings.meshing.nodes_per_element);
  }
  return FillSurface(std::get<SurfaceMesh>(std::move(*mesh)), settings);
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

absl::Status CheckBand(const DeformationModes& solution, const IntendedUse& use) {
  const Eigen::VectorXd& eigenvalues = solution.modes.eigenvalues;
  if ((eigenvalues.array() >= use.UnitEigenvalue(use.low_hz)).any()) return absl::OkStatus();
  const double first_hz = use.FrequencyHz(solution.lowest_eigenvalue);
  absl::Status status =
      Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
              absl::StrFormat(
                  "no natural frequency of the body lies between %g and %g Hz, its first is "
                  "%.5g Hz; check the unit of the file, or choose another size, material or band",
                  use.low_hz, use.high_hz, first_hz));
  AddFigure(status, "first_mode_hz", absl::StrFormat("%.6g", first_hz));
  return status;
}

}  // namespace

absl::StatusOr<ModalModel> Decompose(const MeshFile& file, const DecompositionSettings& settings,
                                     DecompositionObserver& observer) {
  const absl::StatusOr<Body> body = ReadBody(file, settings, observer);
  if (!body.ok()) return body.status();
  observer.OnMesh(body->mesh.nodes.size(), body->mesh.element_count());

  observer.OnProgress(Phase::kAssemble, 0);
  const SystemMatrices system = Assemble(
      body->mesh, {.young_pa = 1, .poisson_ratio = settings.poisson_ratio}, 1, settings.mass);
  if (absl::Status status = SaveMatrices(system, settings); !status.ok()) return status;

  const absl::StatusOr<DeformationModes> solution = SolveDeformationModes(
      system, body->mesh.nodes, settings.use.UnitEigenvalue(settings.use.high_hz),
      [&](SolveStage stage, double done) { observer.OnProgress(PhaseOf(stage), done); });
  if (!solution.ok()) return solution.status();
  if (absl::Status status = CheckBand(*solution, settings.use); !status.ok()) return status;
  observer.OnModes(static_cast<size_t>(solution->modes.eigenvalues.size()));

  observer.OnProgress(Phase::kWrite, 0);
  ModalModel model = MakeModalModel(body->mesh, body->given, *solution);
  model.warnings = body->warnings;
  return model;
}

}  // namespace carillon::precompute
