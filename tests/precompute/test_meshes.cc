// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/test_meshes.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/midside_nodes.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

using Cell = std::array<int, 3>;

/// The six tetrahedra of a cell of unit size, each the path from corner (0,0,0) to (1,1,1) along
/// the axes in one order (Kuhn). Cells side by side cut their common face alike.
std::vector<std::array<Cell, 4>> TetsOfCell() {
  std::vector<std::array<Cell, 4>> tets;
  for (Cell axes : {Cell{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}}) {
    std::array<Cell, 4> path{};
    for (size_t step = 0; step < 3; ++step) {
      path[step + 1] = path[step];
      path[step + 1][static_cast<size_t>(axes[step])] = 1;
    }
    // Odd orders of the axes give a negative volume.
    if ((axes[1] - axes[0] + 3) % 3 != 1) std::swap(path[1], path[2]);
    tets.push_back(path);
  }
  return tets;
}

/// Tetrahedra of a grid of cells whose corner (i, j, k) is node `node_of`.
TetMesh MakeGrid(const Cell& cells, const std::function<int32_t(const Cell&)>& node_of,
                 std::vector<Point> nodes, int nodes_per_element) {
  TetMesh mesh;
  mesh.nodes = std::move(nodes);
  for (int i = 0; i < cells[0]; ++i) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int k = 0; k < cells[2]; ++k) {
        for (const auto& tet : TetsOfCell()) {
          for (const Cell& c : tet)
            mesh.elements.push_back(node_of({i + c[0], j + c[1], k + c[2]}));
        }
      }
    }
  }
  if (!FindBoundary(mesh).ok()) std::abort();
  if (nodes_per_element == 10) AddMidsideNodes(mesh);
  return mesh;
}

}  // namespace

double PolygonRadius(double r, int n) {
  const double angle = 2 * std::numbers::pi / n;
  return r * std::sqrt(angle / std::sin(angle));
}

TetMesh MakeTetTube(const Tube& tube, int nodes_per_element) {
  const double inner_radius_m = tube.outer_radius_m - tube.wall_m;
  std::vector<Point> nodes;
  for (int i = 0; i <= tube.through; ++i) {
    const double r = PolygonRadius(inner_radius_m + tube.wall_m * i / tube.through, tube.around);
    for (int j = 0; j < tube.around; ++j) {
      const double angle = 2 * std::numbers::pi * j / tube.around;
      for (int k = 0; k <= tube.along; ++k) {
        nodes.push_back({r * std::cos(angle), r * std::sin(angle), tube.length_m * k / tube.along});
      }
    }
  }
  const auto node_of = [&](const Cell& c) {
    return (c[0] * tube.around + c[1] % tube.around) * (tube.along + 1) + c[2];
  };
  return MakeGrid({tube.through, tube.around, tube.along}, node_of, std::move(nodes),
                  nodes_per_element);
}

SurfaceMesh MakeTubeSurface(const Tube& tube) {
  Tube one_cell_thick = tube;
  one_cell_thick.through = 1;
  return BoundarySurface(MakeTetTube(one_cell_thick, 4));
}

TetMesh MakeTetBox(const Point& size_m, const std::array<int, 3>& cells, int nodes_per_element) {
  std::vector<Point> nodes;
  for (int i = 0; i <= cells[0]; ++i) {
    for (int j = 0; j <= cells[1]; ++j) {
      for (int k = 0; k <= cells[2]; ++k) {
        nodes.push_back(
            {size_m[0] * i / cells[0], size_m[1] * j / cells[1], size_m[2] * k / cells[2]});
      }
    }
  }
  const auto node_of = [&](const Cell& c) {
    return (c[0] * (cells[1] + 1) + c[1]) * (cells[2] + 1) + c[2];
  };
  return MakeGrid(cells, node_of, std::move(nodes), nodes_per_element);
}

SurfaceMesh MakeBoxSurface(const Point& size_m) {
  return BoundarySurface(MakeTetBox(size_m, {1, 1, 1}, 4));
}

SurfaceMesh InFour(const SurfaceMesh& mesh) {
  SurfaceMesh finer{.vertices = mesh.vertices, .triangles = {}};
  std::map<std::pair<int32_t, int32_t>, int32_t> middle_of_edge;
  const auto middle = [&](int32_t a, int32_t b) {
    const auto [found, is_new] =
        middle_of_edge.try_emplace(std::minmax(a, b), static_cast<int32_t>(finer.vertices.size()));
    if (is_new) {
      const Point p = mesh.vertices[static_cast<size_t>(a)];
      const Point q = mesh.vertices[static_cast<size_t>(b)];
      finer.vertices.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return found->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    finer.triangles.insert(finer.triangles.end(),
                           {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return finer;
}

SurfaceMesh MakeSphereSurface(double radius_m, int halvings) {
  SurfaceMesh sphere{
      {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}}};
  for (int halving = 0; halving < halvings; ++halving) {
    sphere = InFour(sphere);
    for (Point& p : sphere.vertices) {
      const double length = std::hypot(p[0], p[1], p[2]);
      for (double& x : p) x /= length;
    }
  }
  for (Point& p : sphere.vertices) {
    for (double& x : p) x *= radius_m;
  }
  return sphere;
}

TetMesh Part(const TetMesh& mesh, const std::function<bool(const Point&)>& kept) {
  TetMesh part{
      .nodes = {}, .nodes_per_element = mesh.nodes_per_element, .elements = {}, .boundary = {}};
  const auto node_count = static_cast<size_t>(mesh.nodes_per_element);
  std::vector<int32_t> number(mesh.nodes.size(), -1);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* element = &mesh.elements[e * node_count];
    Point middle{};
    for (size_t i = 0; i < 4; ++i) {
      for (size_t x = 0; x < 3; ++x)
        middle[x] += mesh.nodes[static_cast<size_t>(element[i])][x] / 4;
    }
    if (!kept(middle)) continue;
    for (size_t i = 0; i < node_count; ++i) {
      int32_t& to = number[static_cast<size_t>(element[i])];
      if (to < 0) {
        to = static_cast<int32_t>(part.nodes.size());
        part.nodes.push_back(mesh.nodes[static_cast<size_t>(element[i])]);
      }
      part.elements.push_back(to);
    }
  }
  if (!FindBoundary(part).ok()) std::abort();
  return part;
}

TetMesh MakeTetSphere(double radius_m, int corner_count, bool curved) {
  const int halvings = corner_count < 300 ? 2 : 3;
  absl::StatusOr<TetMesh> filled =
      Tetrahedralize(MakeSphereSurface(radius_m, halvings),
                     {.keep_surface = true, .target_node_count = corner_count});
  if (!filled.ok()) std::abort();
  if (!curved) return *std::move(filled);
  for (const BoundaryFace& face : filled->boundary) {
    for (const int32_t node : face.nodes) {
      Point& p = filled->nodes[static_cast<size_t>(node)];
      const double length = std::hypot(p[0], p[1], p[2]);
      for (double& x : p) x *= radius_m / length;
    }
  }
  return *std::move(filled);
}

SurfaceMesh MakeRodSurface(double radius_m, double length_m, int around, int along) {
  SurfaceMesh rod{{{0, 0, 0}, {length_m, 0, 0}}, {}};
  const double r = PolygonRadius(radius_m, around);
  for (int k = 0; k <= along; ++k) {
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * std::numbers::pi * i / around;
      rod.vertices.push_back({length_m * k / along, r * std::cos(angle), r * std::sin(angle)});
    }
  }
  const auto at = [&](int k, int i) { return 2 + k * around + i % around; };
  for (int i = 0; i < around; ++i) {
    rod.triangles.push_back({0, at(0, i + 1), at(0, i)});
    rod.triangles.push_back({1, at(along, i), at(along, i + 1)});
    for (int k = 0; k < along; ++k) {
      rod.triangles.push_back({at(k, i), at(k, i + 1), at(k + 1, i + 1)});
      rod.triangles.push_back({at(k, i), at(k + 1, i + 1), at(k + 1, i)});
    }
  }
  return rod;
}

void AddShell(SurfaceMesh& whole, const SurfaceMesh& part, const Point& offset_m) {
  const auto first = static_cast<int32_t>(whole.vertices.size());
  for (const Point& p : part.vertices) {
    whole.vertices.push_back({p[0] + offset_m[0], p[1] + offset_m[1], p[2] + offset_m[2]});
  }
  for (const auto& t : part.triangles) {
    whole.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

double EnclosedVolume(const SurfaceMesh& surface) {
  double volume_m3 = 0;
  for (const Shell& shell : FindShells(surface)) volume_m3 += shell.volume_m3;
  return volume_m3;
}

SurfaceMesh InsideOut(SurfaceMesh surface) {
  for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  return surface;
}

}  // namespace carillon::precompute
