// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/frontal_structure.h"

#include <cholmod.h>

#include <memory>

#include "proto/error_reason.h"

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
    const double pivots = 3.0 * (super[f + 1] - super[f]);
    const double height = 3.0 * (pi[f + 1] - pi[f]);
    for (double k = 0; k < pivots; ++k) fronts.factor_flops += (height - k) * (height - k);
    const int first_update = pi[f] + super[f + 1] - super[f];
    if (first_update < pi[f + 1]) fronts.parent[f] = owner[static_cast<size_t>(s[first_update])];
  }
  return fronts;
}

}  // namespace

absl::StatusOr<FrontalStructure> AnalyzeFronts(const Eigen::SparseMatrix<double>& K) {
  Eigen::SparseMatrix<double> graph = NodeGraph(K);
  cholmod_sparse view = View(graph);
  cholmod_common common;
  cholmod_start(&common);
  common.nmethods = 1;
  common.method[0].ordering = CHOLMOD_METIS;
  common.supernodal = CHOLMOD_SUPERNODAL;
  common.postorder = 1;
  common.print = 0;
  cholmod_factor* L = cholmod_analyze(&view, &common);
  absl::StatusOr<FrontalStructure> fronts =
      Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
              "the matrix could not be ordered in the memory there is; use fewer nodes");
  if (L != nullptr && L->is_super) fronts = Copy(*L);
  cholmod_free_factor(&L, &common);
  cholmod_finish(&common);
  return fronts;
}

}  // namespace carillon::precompute
