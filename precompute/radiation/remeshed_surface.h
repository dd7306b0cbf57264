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

/// A place on a surface, given as a weighted mean of three vertices.
struct SurfacePlace {
  std::array<int32_t, 3> vertices;
  std::array<double, 3> weights;  ///< they sum to one
};

/// The radiating surface in triangles of one size, with the quantities computed once for it.
struct RemeshedSurface {
  AcousticSurface surface;
  NearCorrection near;
  std::vector<SurfacePlace> places;  ///< the place of each vertex on the radiating surface
};

/// Returns for each vertex of `surface` the nearest place on `given`. A place where both surfaces
/// face the same way is preferred, because the two sides of a thin wall lie close together.
std::vector<SurfacePlace> PlacesOn(const SurfaceMesh& given, const NearestTriangle& index,
                                   const AcousticSurface& surface);

/// Remeshes the radiating surface with edges of about `edge_m`. Errors: Internal
/// RADIATION_REMESHING_FAILED.
absl::StatusOr<RemeshedSurface> MakeRemeshedSurface(const RadiatingSurface& given,
                                                    const NearestTriangle& index, double edge_m,
                                                    Workers& workers);

/// Returns the displacement of a mode at the level's vertices.
Displacement DisplacementOf(const SurfaceModes& modes, size_t mode, const RadiatingSurface& given,
                            const RemeshedSurface& level);

}  // namespace carillon::precompute
