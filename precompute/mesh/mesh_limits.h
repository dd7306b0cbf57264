// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Largest number of triangles of a surface. A larger surface takes more than minutes to check and
/// to mesh.
inline constexpr int kMaxSurfaceTriangles = 1'000'000;

/// Largest number of nodes of a tetrahedral mesh, mid-side nodes included. The factorization of
/// such a mesh needs some 100 GB.
inline constexpr int kMaxMeshNodes = 2'000'000;

/// Largest number of closed shells (the outer one and those of cavities) in one surface.
inline constexpr int kMaxShells = 1'000;

}  // namespace carillon::precompute
