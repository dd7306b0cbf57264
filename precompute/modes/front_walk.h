// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "precompute/modes/frontal_structure.h"
#include "precompute/modes/node_matrix.h"
#include "proto/error_reason.h"

namespace carillon::precompute {

/// Told of the part of a work that is done, 0 to 1.
using PartDone = std::function<void(double)>;

/// The dense matrix of one supernode: its pivot columns (height by pivots) and the update matrix
/// for its parent (updates by updates), both column-major, lower.
template <typename Real>
struct Front {
  int pivots = 0;
  int updates = 0;
  std::vector<Real> panel;
  std::unique_ptr<Real[]> update;

  int height() const { return pivots + updates; }
};

/// Walks the supernodes from the leaves to the roots: assembles each front from A and from the
/// update matrices of its children, and hands it to `eliminate(s, front)`.
template <typename Real, typename Eliminate>
class FrontWalk {
 public:
  FrontWalk(const FrontalStructure& fronts, const NodeMatrix& A, double shift)
      : fronts_(fronts),
        A_(A),
        shift_(shift),
        local_(fronts.order.size()),
        children_(fronts.parent.size()),
        waiting_(fronts.parent.size()) {
    for (int s = 0; s < fronts.supernode_count(); ++s) {
      if (fronts.parent[s] >= 0) children_[fronts.parent[s]].push_back(s);
    }
  }

  absl::Status Run(const Eliminate& eliminate, const PartDone& progress) {
    double done = 0;
    for (int s = 0; s < fronts_.supernode_count(); ++s) {
      Assemble(s);
      if (absl::Status status = eliminate(s, front_); !status.ok()) return status;
      waiting_[s] = std::move(front_.update);
      done += Flops();
      if (progress) progress(std::min(1.0, done / fronts_.factor_flops));
    }
    return absl::OkStatus();
  }

 private:
  double Flops() const {
    const double h = front_.height();
    const double p = front_.pivots;
    return p * h * h - p * p * h + p * p * p / 3;
  }

  void Assemble(int s) {
    const int first = fronts_.first_pivot[s];
    const int last = fronts_.first_pivot[s + 1];
    const int64_t begin = fronts_.row_start[s];
    const int rows = static_cast<int>(fronts_.row_start[s + 1] - begin);
    front_.pivots = 3 * (last - first);
    front_.updates = 3 * rows - front_.pivots;
    front_.panel.assign(static_cast<size_t>(front_.height()) * static_cast<size_t>(front_.pivots),
                        0);
    const size_t update_size =
        static_cast<size_t>(front_.updates) * static_cast<size_t>(front_.updates);
    front_.update = std::make_unique<Real[]>(update_size);
    for (int r = 0; r < rows; ++r) local_[fronts_.rows[begin + r]] = r;
    for (int j = first; j < last; ++j) AddColumn(j);
    for (int child : children_[s]) AddUpdate(child);
  }

  void AddColumn(int j) {
    for (int e = A_.column_start[j]; e < A_.column_start[j + 1]; ++e) {
      const double* block = &A_.stiffness[static_cast<size_t>(e) * 9];
      for (int b = 0; b < 3; ++b) {
        Real* column = Column(3 * local_[j] + b) + 3 * local_[A_.row[e]];
        for (int a = 0; a < 3; ++a) {
          column[a] += static_cast<Real>(block[3 * a + b] - (a == b ? shift_ * A_.mass[e] : 0.0));
        }
      }
    }
  }

  /// The column of the front, indexed by row of the front (for update columns rows below the pivots
  /// only).
  Real* Column(int c) {
    if (c < front_.pivots) return &front_.panel[static_cast<size_t>(c) * front_.height()];
    return front_.update.get() + static_cast<ptrdiff_t>(c - front_.pivots) * front_.updates -
           front_.pivots;
  }

  void AddUpdate(int child) {
    const int64_t begin =
        fronts_.row_start[child] + fronts_.first_pivot[child + 1] - fronts_.first_pivot[child];
    const int rows = static_cast<int>(fronts_.row_start[child + 1] - begin);
    const std::unique_ptr<Real[]> update = std::move(waiting_[child]);
    target_.resize(static_cast<size_t>(rows));
    for (int r = 0; r < rows; ++r) target_[r] = 3 * local_[fronts_.rows[begin + r]];
    const int ld = 3 * rows;
    for (int j = 0; j < rows; ++j) {
      for (int b = 0; b < 3; ++b) {
        const Real* from = update.get() + static_cast<ptrdiff_t>(3 * j + b) * ld;
        Real* to = Column(target_[j] + b);
        for (int i = j; i < rows; ++i) {
          to[target_[i]] += from[3 * i];
          to[target_[i] + 1] += from[3 * i + 1];
          to[target_[i] + 2] += from[3 * i + 2];
        }
      }
    }
  }

  const FrontalStructure& fronts_;
  const NodeMatrix& A_;
  const double shift_;
  std::vector<int32_t> local_;
  std::vector<int32_t> target_;
  std::vector<std::vector<int32_t>> children_;
  std::vector<std::unique_ptr<Real[]>> waiting_;
  Front<Real> front_;
};

}  // namespace carillon::precompute
