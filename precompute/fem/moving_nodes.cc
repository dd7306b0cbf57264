// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/moving_nodes.h"

namespace carillon::precompute {
namespace {

using Sparse = SystemMatrices::Sparse;

/// The new number of each unknown; -1 for one that is left out.
std::vector<int> Renumber(Eigen::Index unknown_count, const std::vector<int32_t>& moving) {
  std::vector<int> number(static_cast<size_t>(unknown_count), -1);
  int next = 0;
  for (const int32_t node : moving) {
    for (size_t a = 0; a < 3; ++a) number[3 * static_cast<size_t>(node) + a] = next++;
  }
  return number;
}

Sparse Restricted(const Sparse& lower, const std::vector<int>& number, int size) {
  Sparse result(size, size);
  result.reserve(lower.nonZeros());
  for (int column = 0; column < lower.outerSize(); ++column) {
    const int j = number[static_cast<size_t>(column)];
    if (j < 0) continue;
    result.startVec(j);
    for (Sparse::InnerIterator it(lower, column); it; ++it) {
      const int i = number[static_cast<size_t>(it.row())];
      if (i >= 0) result.insertBack(i, j) = it.value();
    }
  }
  result.finalize();
  return result;
}

}  // namespace

std::vector<int32_t> MovingNodes(const TetMesh& mesh) {
  std::vector<int32_t> moving;
  moving.reserve(mesh.nodes.size() - mesh.fixed.size());
  auto fixed = mesh.fixed.begin();
  for (int32_t node = 0; node < static_cast<int32_t>(mesh.nodes.size()); ++node) {
    if (fixed != mesh.fixed.end() && *fixed == node) {
      ++fixed;
    } else {
      moving.push_back(node);
    }
  }
  return moving;
}

std::vector<Point> PlacesOf(const std::vector<int32_t>& nodes, const TetMesh& mesh) {
  std::vector<Point> places;
  places.reserve(nodes.size());
  for (const int32_t node : nodes) places.push_back(mesh.nodes[static_cast<size_t>(node)]);
  return places;
}

SystemMatrices Restricted(const SystemMatrices& system, const std::vector<int32_t>& moving) {
  const std::vector<int> number = Renumber(system.unknown_count(), moving);
  const int size = 3 * static_cast<int>(moving.size());
  return {.K = Restricted(system.K, number, size), .M = Restricted(system.M, number, size)};
}

Eigen::MatrixXd Extended(const Eigen::MatrixXd& vectors, const std::vector<int32_t>& moving,
                         size_t node_count) {
  Eigen::MatrixXd all =
      Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(node_count), vectors.cols());
  if (vectors.cols() == 0) return all;  // and `vectors` may have no rows
  for (size_t i = 0; i < moving.size(); ++i) {
    all.middleRows<3>(3 * Eigen::Index{moving[i]}) =
        vectors.middleRows<3>(3 * static_cast<Eigen::Index>(i));
  }
  return all;
}

}  // namespace carillon::precompute
