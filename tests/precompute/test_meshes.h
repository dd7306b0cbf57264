// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <functional>

#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// A hollow cylinder about the z axis, from z = 0.
struct Tube {
  double outer_radius_m = 0.0125;
  double wall_m = 0.001;
  double length_m = 0.505;
  int around = 24;
  int along = 80;
  int through = 1;
};

/// Radius of the regular polygon of n corners that has the area of a circle of radius r: a polygon
/// inscribed in the circle itself would be a smaller tube, and lower in pitch.
double PolygonRadius(double r, int n);

/// The closed surface of a tube: both walls, and the ring at each end (one cell wide).
SurfaceMesh MakeTubeSurface(const Tube& tube);

/// A tube cut into cells of six tetrahedra each, boundary included; `nodes_per_element` 4 or 10
/// with mid-side nodes on straight edges.
TetMesh MakeTetTube(const Tube& tube, int nodes_per_element);

/// A box from the origin to `size_m`, as 12 triangles.
SurfaceMesh MakeBoxSurface(const Point& size_m);

/// The same box cut into `cells` along each axis, six tetrahedra each, boundary included.
TetMesh MakeTetBox(const Point& size_m, const std::array<int, 3>& cells, int nodes_per_element);

/// The tetrahedra of `mesh` whose centroids are `kept`, with the boundary of what they fill. Nodes
/// that no tetrahedron has are left out.
TetMesh Part(const TetMesh& mesh, const std::function<bool(const Point&)>& kept);

/// Each triangle in four, at the middles of its edges.
SurfaceMesh InFour(const SurfaceMesh& mesh);

/// A sphere about the origin: an octahedron whose edges are halved `halvings` times.
SurfaceMesh MakeSphereSurface(double radius_m, int halvings);

/// A ball about the origin, filled with some `corner_count` corners and ten-node tetrahedra; with
/// `curved` the mid-side nodes of its surface lie on the sphere.
TetMesh MakeTetSphere(double radius_m, int corner_count, bool curved);

/// A round bar about the x axis, from x = 0: a polygon of `around` corners with the circle's area,
/// cut `along` times; its ends are fans.
SurfaceMesh MakeRodSurface(double radius_m, double length_m, int around, int along);

/// `part` added to `whole`, moved by `offset_m`.
void AddShell(SurfaceMesh& whole, const SurfaceMesh& part, const Point& offset_m = {0, 0, 0});

/// The volume that a closed surface encloses, without its voids, m^3.
double EnclosedVolume(const SurfaceMesh& surface);

/// The surface turned inside out.
SurfaceMesh InsideOut(SurfaceMesh surface);

}  // namespace carillon::precompute
