// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>

#include <optional>
#include <string>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

using HalfedgeKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
/// CGAL's mesh of triangles. Its algorithms run in a child process, because CGAL's assertions end
/// the process.
using HalfedgeMesh = CGAL::Surface_mesh<HalfedgeKernel::Point_3>;

/// Returns nothing for a surface that is no manifold.
std::optional<HalfedgeMesh> ToHalfedges(const SurfaceMesh& surface);

/// Returns the coordinates and corners of a mesh as the bytes that the child process sends to its
/// parent.
std::string ToBytes(HalfedgeMesh mesh);

/// Returns the surface that ToBytes has written.
SurfaceMesh SurfaceFromBytes(const std::string& bytes);

}  // namespace carillon::precompute
