// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns for each node of the mesh how far the boundary is re-entrant there: the largest angle by
/// which two boundary faces that share an edge of the node enclose more than 180 degrees of the
/// body, in units of 90 degrees and at most 1. It is zero inside the body, on plane and convex
/// parts of the boundary, and at mid-side nodes. At a re-entrant edge the stress is singular
/// (Grisvard, Elliptic Problems in Nonsmooth Domains, 1985).
std::vector<double> ReentrantNodes(const TetMesh& mesh);

}  // namespace carillon::precompute
