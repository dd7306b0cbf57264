// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns whether a mid-side node of the element is further from the middle of its edge than a
/// millionth of the edge's length. Elements of four nodes are straight.
bool IsCurved(const TetMesh& mesh, size_t element);

/// Returns whether a mid-side node of a boundary face is that far from the middle of its edge.
bool IsCurved(const TetMesh& mesh, const BoundaryFace& face);

}  // namespace carillon::precompute
