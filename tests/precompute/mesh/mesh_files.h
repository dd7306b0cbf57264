// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The content of mesh files, with 9 significant digits where they are text.
std::string ToObj(const SurfaceMesh& surface);
std::string ToOff(const SurfaceMesh& surface);
std::string ToTextPly(const SurfaceMesh& surface);
std::string ToBinaryPly(const SurfaceMesh& surface);
std::string ToTextStl(const SurfaceMesh& surface);
std::string ToBinaryStl(const SurfaceMesh& surface);

/// MSH 2.2 with Gmsh's order of mid-side nodes, node numbers from 11 on and the boundary as
/// elements of its own before the tetrahedra.
std::string ToTextGmsh(const TetMesh& mesh);
std::string ToBinaryGmsh(const TetMesh& mesh);

}  // namespace carillon::precompute
