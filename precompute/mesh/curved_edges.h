// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Whether a mid-side node of the element lies beside the middle of its edge, by more than a
/// millionth of the edge's length. Elements of four nodes are straight.
bool IsCurved(const TetMesh& mesh, size_t element);

/// The same for a face of the boundary.
bool IsCurved(const TetMesh& mesh, const BoundaryFace& face);

}  // namespace carillon::precompute
