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

/// MSH 4.1, nodes and boundary as above; the boundary is on surface 6, which is in the physical
/// groups "skin" and 5, its nodes have parameters, and they come in two blocks.
std::string ToTextGmsh41(const TetMesh& mesh);
std::string ToBinaryGmsh41(const TetMesh& mesh);

/// Abaqus' .inp: nodes numbered from 11, some elements over two lines, the boundary as the shells
/// of the set "skin" (and those of its first two faces of "two"), and the first node as the set
/// "tip".
std::string ToInp(const TetMesh& mesh);

/// Medit's .mesh, the boundary with reference 5, vertices with references 5 and (the first) 9.
std::string ToMedit(const TetMesh& mesh);

/// TetGen's .node and .ele, one after the other, nodes numbered from `first`, the first two with
/// the boundary marker 5.
std::string ToTetgen(const TetMesh& mesh, int first);

}  // namespace carillon::precompute
