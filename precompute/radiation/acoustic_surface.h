// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

using ComplexFloat = std::complex<float>;

/// A closed surface with the weights of the vertex rule. The vertex rule approximates the integral
/// over a triangle by a third of its area times the sum of the values at its corners.
struct AcousticSurface {
  SurfaceMesh mesh;
  std::vector<double> areas;        ///< #vertices, m^2: a third of the area of its triangles
  std::vector<Point> area_vectors;  ///< #vertices, m^2: a third of their area vectors; outwards
  std::vector<Point> triangle_area_vectors;  ///< #triangles, m^2
  double mean_edge_m = 0;

  size_t vertex_count() const { return mesh.vertices.size(); }
};

AcousticSurface MakeAcousticSurface(SurfaceMesh mesh);

/// Returns the surface curl of the hat function of corner `c` on triangle `t`, 1/m. It is the edge
/// opposite the corner, divided by twice the triangle's area. Its sign is not specified, but is the
/// same for all corners and triangles.
Point CurlOfHat(const AcousticSurface& surface, size_t t, size_t c);

/// Computes J_i, the integrals of the surface curl of the P1 function `p` by the vertex rule; three
/// numbers for each vertex, m.
void LumpedCurls(const AcousticSurface& surface, std::span<const ComplexFloat> p,
                 std::span<std::array<ComplexFloat, 3>> curls);

/// Applies the transpose of LumpedCurls: adds the sum over i of J_i(hat_v) . field_i, times
/// `factor`, to result_v.
void AddCurlTests(const AcousticSurface& surface,
                  std::span<const std::array<ComplexFloat, 3>> field, ComplexFloat factor,
                  std::span<ComplexFloat> result);

}  // namespace carillon::precompute
