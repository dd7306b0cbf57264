// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/frontal_structure.h"

#include <cholmod.h>

#include <algorithm>
#include <numeric>

#include "precompute/sparse/node_ordering.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// Pattern of the node graph, lower triangle with the diagonal, from the lower triangle of K.
Eigen::SparseMatrix<double> NodeGraph(const Eigen::SparseMatrix<double>& K) {
  const int n = static_cast<int>(K.cols()) / 3;
  Eigen::SparseMatrix<double> graph(n, n);
  for (int j = 0; j < n; ++j) {
    graph.startVec(j);
    for (Eigen::SparseMatrix<double>::InnerIterator it(K, 3 * j); it; ++it) {
      if (it.row() % 3 == 0) graph.insertBack(it.row() / 3, j) = 1.0;
    }
  }
  graph.finalize();
  return graph;
}

cholmod_sparse View(Eigen::SparseMatrix<double>& A) {
  cholmod_sparse view{};
  view.nrow = static_cast<size_t>(A.rows());
  view.ncol = static_cast<size_t>(A.cols());
  view.nzmax = static_cast<size_t>(A.nonZeros());
  view.p = A.outerIndexPtr();
  view.i = A.innerIndexPtr();
  view.x = A.valuePtr();
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

FrontalStructure Copy(const cholmod_factor& L) {
  FrontalStructure fronts;
  const auto* perm = static_cast<const int*>(L.Perm);
  const auto* super = static_cast<const int*>(L.super);
  const auto* pi = static_cast<const int*>(L.pi);
  const auto* s = static_cast<const int*>(L.s);
  const size_t count = L.nsuper;
  fronts.order.assign(perm, perm + L.n);
  fronts.first_pivot.assign(super, super + count + 1);
  fronts.row_start.assign(pi, pi + count + 1);
  fronts.rows.assign(s, s + pi[count]);
  std::vector<int32_t> owner(L.n);
  for (size_t f = 0; f < count; ++f) {
    for (int k = super[f]; k < super[f + 1]; ++k)
      owner[static_cast<size_t>(k)] = static_cast<int>(f);
  }
  fronts.parent.assign(count, -1);
  for (size_t f = 0; f < count; ++f) {
    const int first_update = pi[f] + super[f + 1] - super[f];
    if (first_update < pi[f + 1]) fronts.parent[f] = owner[static_cast<size_t>(s[first_update])];
  }
  return fronts;
}

void FindChildren(FrontalStructure& fronts) {
  const size_t count = fronts.parent.size();
  fronts.child_start.assign(count + 1, 0);
  for (const int32_t parent : fronts.parent) {
    if (parent >= 0) ++fronts.child_start[static_cast<size_t>(parent) + 1];
  }
  std::partial_sum(fronts.child_start.begin(), fronts.child_start.end(),
                   fronts.child_start.begin());
  fronts.child.resize(static_cast<size_t>(fronts.child_start[count]));
  std::vector<int32_t> next(fronts.child_start.begin(), fronts.child_start.end() - 1);
  for (size_t s = 0; s < count; ++s) {
    if (fronts.parent[s] < 0) continue;
    int32_t& slot = next[static_cast<size_t>(fronts.parent[s])];
    fronts.child[static_cast<size_t>(slot++)] = static_cast<int32_t>(s);
  }
}

void CountFlops(FrontalStructure& fronts) {
  for (int s = 0; s < fronts.supernode_count(); ++s) {
    const double h = fronts.height(s);
    const double p = fronts.pivot_count(s);
    fronts.flops.push_back(p * h * h - p * p * h + p * p * p / 3);
    fronts.factor_flops += fronts.flops.back();
  }
}

/// The largest size of a subtree's stack, see FrontWalk.
size_t StackSize(const FrontalStructure& fronts, int begin, int end) {
  const auto update_size = [&](int s) {
    const auto updates = static_cast<size_t>(fronts.update_count(s));
    return updates * updates;
  };
  size_t now = 0;
  size_t most = 0;
  for (int s = begin; s < end; ++s) {
    most = std::max(most, now + update_size(s));
    for (const int child : fronts.children(s)) now -= update_size(child);
    now += update_size(s);
  }
  return most;
}

/// Splits the tree from its roots down until each subtree has a small part of the work.
void SplitTree(FrontalStructure& fronts) {
  constexpr double kLargestPart = 1.0 / 24;
  const auto count = static_cast<size_t>(fronts.supernode_count());
  std::vector<double> work = fronts.flops;
  std::vector<int> first(count);
  for (size_t s = 0; s < count; ++s) {
    first[s] = static_cast<int>(s);
    for (const int child : fronts.children(static_cast<int>(s))) {
      work[s] += work[static_cast<size_t>(child)];
      first[s] = std::min(first[s], first[static_cast<size_t>(child)]);
    }
  }
  for (size_t s = count; s-- > 0;) {
    const int parent = fronts.parent[s];
    const bool under_top =
        parent < 0 || work[static_cast<size_t>(parent)] > kLargestPart * fronts.factor_flops;
    if (work[s] > kLargestPart * fronts.factor_flops) {
      fronts.top.push_back(static_cast<int32_t>(s));
    } else if (under_top) {
      const int end = static_cast<int>(s) + 1;
      fronts.subtrees.push_back(
          {.begin = first[s], .end = end, .stack_size = StackSize(fronts, first[s], end)});
    }
  }
  std::ranges::sort(fronts.top);
}

}  // namespace

absl::StatusOr<FrontalStructure> AnalyzeFronts(const Eigen::SparseMatrix<double>& K) {
  Eigen::SparseMatrix<double> graph = NodeGraph(K);
  cholmod_sparse view = View(graph);
  cholmod_common common;
  cholmod_start(&common);
  common.nmethods = 1;
  std::vector<int> order = OrderThinWall(K);
  common.method[0].ordering = order.empty() ? CHOLMOD_METIS : CHOLMOD_GIVEN;
  common.supernodal = CHOLMOD_SUPERNODAL;
  common.postorder = 1;
  common.print = 0;
  cholmod_factor* L =
      cholmod_analyze_p(&view, order.empty() ? nullptr : order.data(), nullptr, 0, &common);
  absl::StatusOr<FrontalStructure> fronts =
      Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
              "the matrix could not be ordered in the memory there is; use fewer nodes");
  if (L != nullptr && L->is_super) {
    fronts = Copy(*L);
    FindChildren(*fronts);
    CountFlops(*fronts);
    SplitTree(*fronts);
  }
  cholmod_free_factor(&L, &common);
  cholmod_finish(&common);
  return fronts;
}

}  // namespace carillon::precompute
