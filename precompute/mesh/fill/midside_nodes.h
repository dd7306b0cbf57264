// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Turns a mesh of 4-node tetrahedra, boundary included, into one of 10-node tetrahedra with the
/// same straight edges. Corner nodes keep their indices.
void AddMidsideNodes(TetMesh& mesh);

}  // namespace carillon::precompute
