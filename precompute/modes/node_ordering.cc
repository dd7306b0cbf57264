// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/node_ordering.h"

#include <metis.h>

#include <numeric>

namespace carillon::precompute {
namespace {

/// The graph in METIS's form: both directions of every edge, no loops.
struct Adjacency {
  std::vector<idx_t> start;
  std::vector<idx_t> neighbours;
};

/// Calls visit(row_node, column_node) for each pair of different nodes that K couples.
template <typename Visit>
void ForEachPair(const SystemMatrices::Sparse& K, Visit visit) {
  for (int column = 0; column < K.cols(); column += 3) {
    for (SystemMatrices::Sparse::InnerIterator entry(K, column); entry; ++entry) {
      const auto row = static_cast<int>(entry.row());
      if (row % 3 == 0 && row != column) visit(row / 3, column / 3);
    }
  }
}

Adjacency MakeAdjacency(const SystemMatrices::Sparse& K) {
  Adjacency graph{.start = std::vector<idx_t>(static_cast<size_t>(K.cols() / 3) + 1, 0),
                  .neighbours = {}};
  ForEachPair(K, [&](int a, int b) {
    ++graph.start[static_cast<size_t>(a) + 1];
    ++graph.start[static_cast<size_t>(b) + 1];
  });
  std::partial_sum(graph.start.begin(), graph.start.end(), graph.start.begin());
  graph.neighbours.resize(static_cast<size_t>(graph.start.back()));
  std::vector<idx_t> next(graph.start.begin(), graph.start.end() - 1);
  ForEachPair(K, [&](int a, int b) {
    graph.neighbours[static_cast<size_t>(next[static_cast<size_t>(a)]++)] = b;
    graph.neighbours[static_cast<size_t>(next[static_cast<size_t>(b)]++)] = a;
  });
  return graph;
}

}  // namespace

std::vector<int> OrderUnknowns(const SystemMatrices& system) {
  Adjacency graph = MakeAdjacency(system.K);
  auto node_count = static_cast<idx_t>(graph.start.size() - 1);
  std::vector<idx_t> order(static_cast<size_t>(node_count));
  std::vector<idx_t> position(order.size());
  std::iota(order.begin(), order.end(), 0);
  if (!graph.neighbours.empty()) {
    METIS_NodeND(&node_count, graph.start.data(), graph.neighbours.data(), nullptr, nullptr,
                 order.data(), position.data());
  }
  std::vector<int> unknowns;
  unknowns.reserve(3 * order.size());
  for (const idx_t node : order) {
    for (int a = 0; a < 3; ++a) unknowns.push_back(3 * static_cast<int>(node) + a);
  }
  return unknowns;
}

}  // namespace carillon::precompute
