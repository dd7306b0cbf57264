// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/body.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/fem/curved_element.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/midside_nodes.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/read/read_mesh.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/pipeline/body_regions.h"
#include "precompute/pipeline/model_checks.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

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
                                 const worker::v1::WorkerRequest& request) {
  ASSIGN_OR_RETURN(TetMesh mesh,
                   Tetrahedralize(surface.prepared.surface, meshing, surface.prepared.walls));
  if (!surface.prepared.parts.empty()) NameRegions(surface.prepared.parts, mesh);
  for (BoundaryFace& face : mesh.boundary) {
    face.given_triangle = surface.prepared.given_triangle[static_cast<size_t>(face.given_triangle)];
  }
  RETURN_IF_ERROR(FixNodes(FixturesOf(request), surface.given, surface.names, mesh));
  std::vector<std::string> warnings = surface.prepared.warnings;
  const int asked = static_cast<int>(request.settings().mesh().target_node_count());
  if (meshing.target_node_count == asked) WarnOfMoreNodes(asked, mesh, warnings);
  return Body{surface.given, std::move(mesh), surface.materials, std::move(warnings),
              surface.prepared.frequency_error};
}

absl::StatusOr<Body> TakeTetrahedra(TetMesh mesh, const MeshNames& names, BodyMaterials materials,
                                    const worker::v1::WorkerRequest& request) {
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
  return Body{std::move(given), std::move(mesh), std::move(materials), {}};
}

/// Whether the surface may get other triangles. Fixtures can name vertices of the given ones.
bool MayCoarsen(const worker::v1::WorkerRequest& request) {
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

/// Returns the outside of a body of one material whose regions touch in faces or rims that they
/// share; nothing if they do not.
std::optional<PreparedSurface> JoinRegions(const SurfaceMesh& given,
                                           const std::vector<int32_t>& region_of_triangle,
                                           const MeshNames& names) {
  if (names.regions.size() < 2) return std::nullopt;
  std::vector<std::string> shown;
  shown.reserve(names.regions.size());
  for (const MeshRegion& region : names.regions) shown.push_back(QuotedText(region.name));
  absl::StatusOr<PreparedSurface> joined = PrepareParts(given, region_of_triangle, shown);
  if (!joined.ok()) return std::nullopt;
  joined->walls.clear();
  joined->parts.clear();
  return *std::move(joined);
}

absl::StatusOr<PreparedSurface> Prepare(const SurfaceMesh& given,
                                        const std::vector<int32_t>& region_of_triangle,
                                        const MeshNames& names, const BodyMaterials& materials,
                                        const worker::v1::WorkerRequest& request) {
  const v1::DecompositionSettings& settings = request.settings();
  const v1::MeshSettings& mesh = settings.mesh();
  if (settings.regions().empty()) {
    if (mesh.wall_m() == 0 && !region_of_triangle.empty() && !CheckSurface(given).ok()) {
      std::optional<PreparedSurface> joined = JoinRegions(given, region_of_triangle, names);
      if (joined) return *std::move(joined);
    }
    return PrepareSurface(given, {.repair = mesh.repair(),
                                  .wall_m = mesh.wall_m(),
                                  .coarsen = MayCoarsen(request),
                                  .most_triangles = 2 * mesh.target_node_count()});
  }
  if (mesh.repair() || mesh.wall_m() > 0) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "repair and wall are for a body of one material: leave them out, or repair the "
                   "parts of the body before they are put together");
  }
  std::vector<std::string> shown;
  shown.reserve(materials.regions().size());
  for (const RegionMaterial& region : materials.regions()) {
    shown.push_back(QuotedText(region.region));
  }
  return PrepareParts(given, region_of_triangle, shown);
}

}  // namespace

absl::StatusOr<Input> ReadInput(const std::string& bytes, const worker::v1::WorkerRequest& request,
                                DecompositionObserver& observer) {
  observer.OnProgress(v1::PHASE_READ, 0);
  const v1::DecompositionSettings& settings = request.settings();
  ASSIGN_OR_RETURN(NamedMesh read,
                   ParseMesh(bytes, request.mesh_format(), MetresPerUnit(settings)));
  const double extent_m = ExtentOf(read.mesh);
  observer.OnExtent(UseOf(request).size * extent_m);
  if (settings.metres_per_unit() == 0) {
    RETURN_IF_ERROR(CheckUnit(extent_m, UseOf(request)));
    // Lengths of glTF are metres by its specification.
    const bool metres = request.mesh_format() == "glb" || request.mesh_format() == "gltf";
    if (!metres) WarnOfUnit(extent_m, UseOf(request), read.warnings);
  }
  ASSIGN_OR_RETURN(RegionMaterials regions, MaterialsOf(request, read.names));
  const auto number = [&](std::vector<int32_t>& numbers) {
    if (settings.regions().empty()) return numbers.clear();
    for (int32_t& region : numbers)
      region = regions.material_of_region[static_cast<size_t>(region)];
  };
  observer.OnProgress(v1::PHASE_MESH, 0);
  if (auto* tetrahedra = std::get_if<TetMesh>(&read.mesh)) {
    number(tetrahedra->regions);
    ASSIGN_OR_RETURN(Body body, TakeTetrahedra(std::move(*tetrahedra), read.names,
                                               std::move(regions.materials), request));
    body.warnings = std::move(read.warnings);
    return body;
  }
  auto& given = std::get<SurfaceMesh>(read.mesh);
  std::vector<int32_t> region_of_triangle = read.names.triangle_regions;
  number(read.names.triangle_regions);
  if (!settings.regions().empty()) region_of_triangle = read.names.triangle_regions;
  absl::StatusOr<PreparedSurface> prepared =
      Prepare(given, region_of_triangle, read.names, regions.materials, request);
  if (!prepared.ok()) return WithExtent(prepared.status(), given);
  std::ranges::move(read.warnings, std::back_inserter(prepared->warnings));
  return Fillable{std::move(given), *std::move(prepared), std::move(regions.materials),
                  std::move(read.names)};
}

absl::StatusOr<Body> Fill(const Fillable& surface, MeshingSettings meshing,
                          const worker::v1::WorkerRequest& request) {
  const double most_node_count = std::exchange(meshing.most_node_count, 0);
  if (!meshing.relative_size.is_uniform()) {
    MeshingSettings limited = meshing;
    limited.most_node_count = most_node_count;
    absl::StatusOr<Body> graded = FillSurface(surface, limited, request);
    if (graded.ok() && static_cast<double>(graded->mesh.nodes.size()) <= most_node_count) {
      graded->graded = true;
      return graded;
    }
    meshing.relative_size = {};
  }
  return FillSurface(surface, meshing, request);
}

}  // namespace carillon::precompute
