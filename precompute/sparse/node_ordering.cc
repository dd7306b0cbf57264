// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/node_ordering.h"

#include <metis.h>

#include <cmath>
#include <numeric>
#include <utility>

namespace carillon::precompute {
namespace {

/// The graph in METIS's form: both directions of every edge, no loops.
struct Adjacency {
  std::vector<idx_t> start;
  std::vector<idx_t> neighbours;
  std::vector<float> couplings;  ///< of each neighbour, by the first component

  idx_t node_count() const { return static_cast<idx_t>(start.size() - 1); }
};

/// Calls visit(row_node, column_node, coupling) for each pair of different nodes that K couples.
template <typename Visit>
void ForEachPair(const SystemMatrices::Sparse& K, Visit visit) {
  for (int column = 0; column < K.cols(); column += 3) {
    for (SystemMatrices::Sparse::InnerIterator entry(K, column); entry; ++entry) {
      const auto row = static_cast<int>(entry.row());
      if (row % 3 == 0 && row != column) visit(row / 3, column / 3, entry.value());
    }
  }
}

Adjacency MakeAdjacency(const SystemMatrices::Sparse& K) {
  Adjacency graph{.start = std::vector<idx_t>(static_cast<size_t>(K.cols() / 3) + 1, 0),
                  .neighbours = {},
                  .couplings = {}};
  ForEachPair(K, [&](int a, int b, double) {
    ++graph.start[static_cast<size_t>(a) + 1];
    ++graph.start[static_cast<size_t>(b) + 1];
  });
  std::partial_sum(graph.start.begin(), graph.start.end(), graph.start.begin());
  graph.neighbours.resize(static_cast<size_t>(graph.start.back()));
  graph.couplings.resize(graph.neighbours.size());
  std::vector<idx_t> next(graph.start.begin(), graph.start.end() - 1);
  ForEachPair(K, [&](int a, int b, double coupling) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      const auto at = static_cast<size_t>(next[static_cast<size_t>(from)]++);
      graph.neighbours[at] = to;
      graph.couplings[at] = static_cast<float>(std::abs(coupling));
    }
  });
  return graph;
}

/// Nodes in pairs: each node is paired with the remaining node to which it is coupled most
/// strongly; -1 if none remained.
struct Pairs {
  std::vector<std::pair<idx_t, idx_t>> nodes;
  std::vector<idx_t> number;  ///< the pair of each node
};

Pairs FindPairs(const Adjacency& graph) {
  Pairs pairs;
  pairs.number.assign(graph.start.size() - 1, -1);
  for (idx_t node = 0; node < graph.node_count(); ++node) {
    if (pairs.number[static_cast<size_t>(node)] >= 0) continue;
    idx_t other = -1;
    float most = -1;
    for (auto e = static_cast<size_t>(graph.start[static_cast<size_t>(node)]);
         e < static_cast<size_t>(graph.start[static_cast<size_t>(node) + 1]); ++e) {
      const bool left = pairs.number[static_cast<size_t>(graph.neighbours[e])] < 0;
      if (!left || graph.couplings[e] <= most) continue;
      most = graph.couplings[e];
      other = graph.neighbours[e];
    }
    const auto number = static_cast<idx_t>(pairs.nodes.size());
    pairs.number[static_cast<size_t>(node)] = number;
    if (other >= 0) pairs.number[static_cast<size_t>(other)] = number;
    pairs.nodes.emplace_back(node, other);
  }
  return pairs;
}

/// The graph whose nodes are pairs.
Adjacency Contract(const Adjacency& graph, const Pairs& pairs) {
  Adjacency coarse{.start = {0}, .neighbours = {}, .couplings = {}};
  std::vector<idx_t> seen_by(pairs.nodes.size(), -1);
  for (size_t p = 0; p < pairs.nodes.size(); ++p) {
    const auto self = static_cast<idx_t>(p);
    seen_by[p] = self;
    for (const idx_t node : {pairs.nodes[p].first, pairs.nodes[p].second}) {
      if (node < 0) continue;
      for (auto e = static_cast<size_t>(graph.start[static_cast<size_t>(node)]);
           e < static_cast<size_t>(graph.start[static_cast<size_t>(node) + 1]); ++e) {
        const idx_t other = pairs.number[static_cast<size_t>(graph.neighbours[e])];
        if (std::exchange(seen_by[static_cast<size_t>(other)], self) == self) continue;
        coarse.neighbours.push_back(other);
      }
    }
    coarse.start.push_back(static_cast<idx_t>(coarse.neighbours.size()));
  }
  return coarse;
}

/// Nested dissection of a graph whose vertices have these weights.
std::vector<idx_t> Dissect(Adjacency& graph, std::vector<idx_t> weights) {
  idx_t node_count = graph.node_count();
  std::vector<idx_t> order(static_cast<size_t>(node_count));
  std::vector<idx_t> position(order.size());
  std::iota(order.begin(), order.end(), 0);
  if (!graph.neighbours.empty()) {
    METIS_NodeND(&node_count, graph.start.data(), graph.neighbours.data(), weights.data(), nullptr,
                 order.data(), position.data());
  }
  return order;
}

}  // namespace

std::vector<int> OrderThinWall(const SystemMatrices::Sparse& K) {
  // This ratio is about 0.3 for a wall one element thick and 0.7 for a solid.
  constexpr double kMostEdgesLeft = 0.4;
  const Adjacency graph = MakeAdjacency(K);
  const Pairs pairs = FindPairs(graph);
  Adjacency coarse = Contract(graph, pairs);
  const auto edges = static_cast<double>(graph.neighbours.size());
  if (static_cast<double>(coarse.neighbours.size()) > kMostEdgesLeft * edges) return {};
  std::vector<idx_t> weights;
  for (const auto& pair : pairs.nodes) weights.push_back(pair.second < 0 ? 1 : 2);
  std::vector<int> order;
  for (const idx_t p : Dissect(coarse, std::move(weights))) {
    const auto& [first, second] = pairs.nodes[static_cast<size_t>(p)];
    order.push_back(first);
    if (second >= 0) order.push_back(second);
  }
  return order;
}

}  // namespace carillon::precompute
