// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/fem/body_materials.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/mesh_names.h"
#include "precompute/mesh/surface/prepare_surface.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/pipeline/decomposition_observer.h"

namespace carillon::precompute {

/// The body to decompose, and the surface that its boundary refers to.
struct Body {
  SurfaceMesh given;
  TetMesh mesh;
  BodyMaterials materials;  ///< relative to the reference of the request
  std::vector<std::string> warnings;
  double frequency_error = 0;  ///< estimated and relative, because its surface was coarsened
  bool graded = false;         ///< the mesh has the relative sizes that were asked for
};

/// A surface that can be filled as finely as one likes.
struct Fillable {
  SurfaceMesh given;
  PreparedSurface prepared;
  BodyMaterials materials;  ///< relative to the reference of the request
  MeshNames names;
};

/// A surface to be filled, or a mesh of tetrahedra as it is.
using Input = std::variant<Fillable, Body>;

/// Reads the bytes of a mesh file, and prepares a surface as `request` wants it. Errors: those of
/// ParseMesh, MaterialsOf, CheckUnit, PrepareSurface and FixNodes; INVALID_SETTINGS if linear
/// elements are requested but the mesh has ten-node elements.
absl::StatusOr<Input> ReadInput(const std::string& bytes, const worker::v1::WorkerRequest& request,
                                DecompositionObserver& observer);

/// Fills a surface with tetrahedra, and finds the nodes that are fixed. If a graded mesh would have
/// more nodes than `meshing` allows it, which the prediction can be wrong about for walls, the mesh
/// becomes uniform. Errors: those of Tetrahedralize and FixNodes.
absl::StatusOr<Body> Fill(const Fillable& surface, MeshingSettings meshing,
                          const worker::v1::WorkerRequest& request);

}  // namespace carillon::precompute
