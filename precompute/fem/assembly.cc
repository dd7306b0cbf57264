// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/assembly.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "precompute/fem/curved_element.h"
#include "precompute/fem/moving_nodes.h"
#include "precompute/mesh/curved_edges.h"

namespace carillon::precompute {
namespace {

using Sparse = SystemMatrices::Sparse;

/// Which nodes share an element: neighbours[start[c] ... start[c + 1]) are the nodes r >= c coupled
/// to node c, ascending, c itself first.
struct NodeGraph {
  std::vector<int> start;
  std::vector<int> neighbours;

  size_t node_count() const { return start.size() - 1; }
  std::span<const int> Rows(size_t column) const {
    return std::span(neighbours)
        .subspan(static_cast<size_t>(start[column]),
                 static_cast<size_t>(start[column + 1] - start[column]));
  }
  /// Position of `row` among Rows(column).
  int Find(int row, int column) const {
    const std::span<const int> rows = Rows(static_cast<size_t>(column));
    return static_cast<int>(std::ranges::lower_bound(rows, row) - rows.begin());
  }
};

std::span<const int32_t> ElementNodes(const TetMesh& mesh, size_t element) {
  const auto count = static_cast<size_t>(mesh.nodes_per_element);
  return std::span(mesh.elements).subspan(element * count, count);
}

/// For each node, the elements that have it: those of node i are items[start[i] ... start[i + 1]).
struct Incidence {
  std::vector<int> start;
  std::vector<int> items;
};

Incidence ElementsOfNodes(const TetMesh& mesh) {
  Incidence incidence{.start = std::vector<int>(mesh.nodes.size() + 1, 0),
                      .items = std::vector<int>(mesh.elements.size())};
  for (const int32_t node : mesh.elements) ++incidence.start[static_cast<size_t>(node) + 1];
  std::partial_sum(incidence.start.begin(), incidence.start.end(), incidence.start.begin());
  std::vector<int> next(incidence.start.begin(), incidence.start.end() - 1);
  for (size_t k = 0; k < mesh.elements.size(); ++k) {
    int& slot = next[static_cast<size_t>(mesh.elements[k])];
    incidence.items[static_cast<size_t>(slot++)] =
        static_cast<int>(k / static_cast<size_t>(mesh.nodes_per_element));
  }
  return incidence;
}

NodeGraph MakeNodeGraph(const TetMesh& mesh) {
  const Incidence incidence = ElementsOfNodes(mesh);
  NodeGraph graph;
  graph.start.assign(1, 0);
  std::vector<int> last_column(mesh.nodes.size(), -1);
  for (int column = 0; column < static_cast<int>(mesh.nodes.size()); ++column) {
    const auto c = static_cast<size_t>(column);
    const auto first = static_cast<std::ptrdiff_t>(graph.neighbours.size());
    for (int k = incidence.start[c]; k < incidence.start[c + 1]; ++k) {
      for (const int row :
           ElementNodes(mesh, static_cast<size_t>(incidence.items[static_cast<size_t>(k)]))) {
        if (row < column || last_column[static_cast<size_t>(row)] == column) continue;
        last_column[static_cast<size_t>(row)] = column;
        graph.neighbours.push_back(row);
      }
    }
    std::sort(graph.neighbours.begin() + first, graph.neighbours.end());
    graph.start.push_back(static_cast<int>(graph.neighbours.size()));
  }
  return graph;
}

/// Reserves column pointers from the entries that each column has, and gives the inner indices
/// room.
Sparse MakePattern(const std::vector<int>& column_sizes) {
  const auto size = static_cast<Eigen::Index>(column_sizes.size());
  Sparse matrix(size, size);
  std::partial_sum(column_sizes.begin(), column_sizes.end(), matrix.outerIndexPtr() + 1);
  matrix.resizeNonZeros(matrix.outerIndexPtr()[size]);
  std::fill_n(matrix.valuePtr(), matrix.nonZeros(), 0.0);
  return matrix;
}

/// The lower triangle of a matrix with a full 3x3 block for each pair of the graph.
Sparse MakeBlockPattern(const NodeGraph& graph) {
  std::vector<int> sizes;
  for (size_t c = 0; c < graph.node_count(); ++c) {
    const int below = 3 * (static_cast<int>(graph.Rows(c).size()) - 1);
    for (int k = 0; k < 3; ++k) sizes.push_back(3 - k + below);
  }
  Sparse matrix = MakePattern(sizes);
  int* row_index = matrix.innerIndexPtr();
  for (size_t c = 0; c < graph.node_count(); ++c) {
    for (int k = 0; k < 3; ++k) {
      for (const int r : graph.Rows(c)) {
        for (int a = r == static_cast<int>(c) ? k : 0; a < 3; ++a) *row_index++ = 3 * r + a;
      }
    }
  }
  return matrix;
}

/// The lower triangle of a matrix with a diagonal 3x3 block for each pair of the graph, or for each
/// node alone.
Sparse MakeDiagonalBlockPattern(const NodeGraph& graph, bool nodes_alone) {
  std::vector<int> sizes;
  for (size_t c = 0; c < graph.node_count(); ++c) {
    sizes.insert(sizes.end(), 3, nodes_alone ? 1 : static_cast<int>(graph.Rows(c).size()));
  }
  Sparse matrix = MakePattern(sizes);
  int* row_index = matrix.innerIndexPtr();
  for (size_t c = 0; c < graph.node_count(); ++c) {
    for (int k = 0; k < 3; ++k) {
      for (const int r : graph.Rows(c).first(nodes_alone ? 1 : graph.Rows(c).size())) {
        *row_index++ = 3 * r + k;
      }
    }
  }
  return matrix;
}

/// Adds the part of `block` (rows of a node, columns of `column`) that lies in the lower triangle;
/// `position` is the row node's place in the column of the graph.
template <typename Block>
void AddStiffness(Sparse& K, int column, int position, const Block& block) {
  for (int k = 0; k < 3; ++k) {
    double* values = K.valuePtr() + K.outerIndexPtr()[3 * column + k];
    if (position == 0) {
      for (int a = k; a < 3; ++a) values[a - k] += block(a, k);
    } else {
      values += 3 - k + 3 * (position - 1);
      for (int a = 0; a < 3; ++a) values[a] += block(a, k);
    }
  }
}

void AddMass(Sparse& M, int column, int position, double mass) {
  for (int k = 0; k < 3; ++k) M.valuePtr()[M.outerIndexPtr()[3 * column + k] + position] += mass;
}

}  // namespace

TetGeometry GeometryOf(const TetMesh& mesh, size_t element) {
  const std::span<const int32_t> nodes = ElementNodes(mesh, element);
  Eigen::Matrix<double, 3, 4> corners;
  for (int i = 0; i < 4; ++i) {
    const Point& p = mesh.nodes[static_cast<size_t>(nodes[static_cast<size_t>(i)])];
    corners.col(i) = Eigen::Vector3d(p[0], p[1], p[2]);
  }
  return MakeTetGeometry(corners);
}

namespace {

template <typename Stiffness, typename Mass>
void AddElement(const NodeGraph& graph, std::span<const int32_t> nodes, const Stiffness& stiffness,
                const Mass& mass, SystemMatrices& system) {
  for (int j = 0; j < Mass::ColsAtCompileTime; ++j) {
    const int column = nodes[static_cast<size_t>(j)];
    for (int i = 0; i < Mass::RowsAtCompileTime; ++i) {
      const int row = nodes[static_cast<size_t>(i)];
      if (row < column) continue;
      const int position = graph.Find(row, column);
      AddStiffness(system.K, column, position, stiffness.template block<3, 3>(3 * i, 3 * j));
      if (mass(i, j) != 0) AddMass(system.M, column, position, mass(i, j));
    }
  }
}

}  // namespace

SystemMatrices Assemble(const TetMesh& mesh, const BodyMaterials& materials, MassSharing sharing) {
  const NodeGraph graph = MakeNodeGraph(mesh);
  SystemMatrices system{.K = MakeBlockPattern(graph),
                        .M = MakeDiagonalBlockPattern(graph, sharing == MassSharing::kLumped)};
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const std::span<const int32_t> nodes = ElementNodes(mesh, e);
    const LameConstants& lame = materials.LameOf(mesh, e);
    const double density_kg_per_m3 = materials.DensityOf(mesh, e);
    if (IsCurved(mesh, e)) {
      const TenNodes places = NodesOf(mesh, e);
      AddElement(graph, nodes, MakeCurvedStiffness(places, lame),
                 MakeCurvedMass(places, density_kg_per_m3, sharing), system);
      continue;
    }
    const TetGeometry geometry = GeometryOf(mesh, e);
    if (mesh.nodes_per_element == 4) {
      AddElement(graph, nodes, MakeLinearStiffness(geometry, lame),
                 MakeLinearMass(geometry.volume_m3, density_kg_per_m3, sharing), system);
    } else {
      AddElement(graph, nodes, MakeQuadraticStiffness(geometry, lame),
                 MakeQuadraticMass(geometry.volume_m3, density_kg_per_m3, sharing), system);
    }
  }
  if (mesh.fixed.empty()) return system;
  return Restricted(system, MovingNodes(mesh));
}

double VolumeM3(const TetMesh& mesh) {
  double volume = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    volume += IsCurved(mesh, e) ? CurvedVolumeM3(NodesOf(mesh, e)) : GeometryOf(mesh, e).volume_m3;
  }
  return volume;
}

}  // namespace carillon::precompute
