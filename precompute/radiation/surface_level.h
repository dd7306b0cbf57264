// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/radiation/acoustic_surface.h"
#include "precompute/radiation/boundary_operator.h"
#include "precompute/radiation/near_correction.h"
#include "precompute/radiation/radiating_surface.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// A place on a surface: a mean of three of its vertices.
struct SurfacePlace {
  std::array<int32_t, 3> vertices;
  std::array<double, 3> weights;  ///< they sum to one
};

/// The radiating surface in triangles of one size, with the quantities computed once for it.
struct SurfaceLevel {
  AcousticSurface surface;
  NearCorrection near;
  std::vector<SurfacePlace> places;  ///< of each vertex on the radiating surface
};

/// The nearest place of each vertex of `surface` on `given`, preferably where both face the same
/// way: the two sides of a thin wall lie close together.
std::vector<SurfacePlace> PlacesOn(const SurfaceMesh& given, const NearestTriangle& index,
                                   const AcousticSurface& surface);

/// Errors: Internal RADIATION_REMESHING_FAILED.
absl::StatusOr<SurfaceLevel> MakeSurfaceLevel(const RadiatingSurface& given,
                                              const NearestTriangle& index, double edge_m,
                                              Workers& workers);

/// The displacement of a mode at the level's vertices.
Displacement DisplacementOf(const SurfaceModes& modes, size_t mode, const RadiatingSurface& given,
                            const SurfaceLevel& level);

}  // namespace carillon::precompute
