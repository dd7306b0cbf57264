// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Largest surface accepted: larger ones take more than minutes to check and to mesh.
inline constexpr int kMaxSurfaceTriangles = 1'000'000;

/// Largest tetrahedral mesh, corner and mid-side nodes: its factorization needs some 100 GB.
inline constexpr int kMaxMeshNodes = 2'000'000;

/// Most closed shells (the outside and its cavities) in one surface.
inline constexpr int kMaxShells = 1'000;

}  // namespace carillon::precompute
