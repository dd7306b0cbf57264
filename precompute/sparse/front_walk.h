// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "precompute/sparse/front_elimination.h"
#include "precompute/sparse/frontal_structure.h"
#include "precompute/sparse/mutex.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {

/// Called with the finished fraction of a task, 0 to 1.
using PartDone = std::function<void(double)>;

/// Walks the supernodes from the leaves to the roots: assembles each front from A and from the
/// update matrices of its children, and passes it to `visit(s, front, workers)`. Subtrees are
/// processed in parallel, each by one thread with its update matrices on a stack. The fronts above
/// the subtrees follow one by one, and all threads share each of them.
template <typename Real, typename Visit>
class FrontWalk {
 public:
  FrontWalk(const FrontalStructure& fronts, const NodeMatrix& A, double shift, const Visit& visit,
            Workers& workers)
      : fronts_(fronts),
        A_(A),
        shift_(shift),
        visit_(visit),
        workers_(workers),
        waiting_(fronts.parent.size(), nullptr),
        kept_(fronts.parent.size()) {}

  absl::Status Run(const PartDone& progress) {
    absl::Status status = RunSubtrees(progress);
    if (!status.ok()) return status;
    Assembler assembler(*this);
    for (const int s : fronts_.top) {
      const size_t size = UpdateSize(s);
      kept_[s].reset(new Real[size]);
      status = assembler.Process(s, kept_[s].get(), workers_);
      if (!status.ok()) return status;
      waiting_[s] = kept_[s].get();
      for (const int child : fronts_.children(s)) kept_[child].reset();
      done_ = done_ + fronts_.flops[s];
      Report(progress);
    }
    return absl::OkStatus();
  }

 private:
  class Assembler;

  size_t UpdateSize(int s) const {
    const auto updates = static_cast<size_t>(fronts_.update_count(s));
    return updates * updates;
  }

  void Report(const PartDone& progress) const {
    if (progress) progress(std::min(1.0, done_ / fronts_.factor_flops));
  }

  absl::Status RunSubtrees(const PartDone& progress) {
    std::atomic<size_t> next = 0;
    absl::Status failure;
    Mutex mutex;
    const size_t stack_size = LargestStack();
    workers_.Run([&](int t) {
      Workers alone(1);
      Assembler assembler(*this);
      const std::unique_ptr<Real[]> stack(new Real[stack_size]);
      for (size_t i = next++; i < fronts_.subtrees.size(); i = next++) {
        const absl::Status status = RunSubtree(fronts_.subtrees[i], stack.get(), assembler, alone);
        const MutexLock lock(mutex);
        if (!status.ok()) failure = status;
        if (!failure.ok()) return;
        for (int s = fronts_.subtrees[i].begin; s < fronts_.subtrees[i].end; ++s) {
          done_ = done_ + fronts_.flops[s];
        }
        if (t == 0) Report(progress);
      }
    });
    return failure;
  }

  /// When a parent is processed, the update matrices of its children are on top of the stack. The
  /// parent's own update matrix is computed above them and then moved down to their place.
  absl::Status RunSubtree(const Subtree& subtree, Real* stack, Assembler& assembler,
                          Workers& alone);

  size_t LargestStack() const {
    size_t largest = 0;
    for (const Subtree& subtree : fronts_.subtrees) {
      largest = std::max(largest, subtree.stack_size);
    }
    return largest;
  }

  /// Moves the lower triangle of an update matrix; `to` may equal `from` or precede it.
  static void MoveUpdate(const Real* from, ptrdiff_t columns, Real* to) {
    for (ptrdiff_t j = 0; j < columns; ++j) {
      std::memmove(to + j * (columns + 1), from + j * (columns + 1),
                   static_cast<size_t>(columns - j) * sizeof(Real));
    }
  }

  class Assembler {
   public:
    explicit Assembler(FrontWalk& walk) : walk_(walk), local_(walk.fronts_.order.size()) {}

    absl::Status Process(int s, Real* update, Workers& workers) {
      Assemble(s, update);
      return walk_.visit_(s, front_, workers);
    }

   private:
    void Assemble(int s, Real* update) {
      const FrontalStructure& fronts = walk_.fronts_;
      const int first = fronts.first_pivot[s];
      const int last = fronts.first_pivot[s + 1];
      const int64_t begin = fronts.row_start[s];
      const int rows = static_cast<int>(fronts.row_start[s + 1] - begin);
      front_.pivots = 3 * (last - first);
      front_.updates = 3 * rows - front_.pivots;
      const auto size = static_cast<size_t>(front_.height()) * static_cast<size_t>(front_.pivots);
      if (front_.panel.capacity() < size)
        front_.panel = {};  // frees the old panel first, to save memory
      front_.panel.assign(size, 0);
      front_.update = update;
      for (int j = 0; j < front_.updates; ++j) {
        std::fill_n(update + static_cast<ptrdiff_t>(j) * (front_.updates + 1), front_.updates - j,
                    Real{0});
      }
      for (int r = 0; r < rows; ++r) local_[fronts.rows[begin + r]] = r;
      for (int j = first; j < last; ++j) AddColumn(j);
      for (const int child : fronts.children(s)) AddUpdate(child);
    }

    void AddColumn(int j) {
      const NodeMatrix& A = walk_.A_;
      for (int e = A.column_start[j]; e < A.column_start[j + 1]; ++e) {
        const double* block = &A.stiffness[static_cast<size_t>(e) * 9];
        for (int b = 0; b < 3; ++b) {
          Real* column = Column(3 * local_[j] + b) + 3 * local_[A.row[e]];
          for (int a = 0; a < 3; ++a) {
            column[a] +=
                static_cast<Real>(block[3 * a + b] - (a == b ? walk_.shift_ * A.mass[e] : 0.0));
          }
        }
      }
    }

    /// Returns column `c` of the front, to be indexed by the front's rows. Columns of the update
    /// matrix have only the rows below the pivots.
    Real* Column(int c) {
      if (c < front_.pivots) return &front_.panel[static_cast<size_t>(c) * front_.height()];
      return front_.update + static_cast<ptrdiff_t>(c - front_.pivots) * front_.updates -
             front_.pivots;
    }

    void AddUpdate(int child) {
      const FrontalStructure& fronts = walk_.fronts_;
      const int64_t begin =
          fronts.row_start[child] + fronts.first_pivot[child + 1] - fronts.first_pivot[child];
      const int rows = static_cast<int>(fronts.row_start[child + 1] - begin);
      const Real* update = walk_.waiting_[child];
      target_.resize(static_cast<size_t>(rows));
      for (int r = 0; r < rows; ++r) target_[r] = 3 * local_[fronts.rows[begin + r]];
      const ptrdiff_t ld = 3 * rows;
      for (int j = 0; j < rows; ++j) {
        for (int b = 0; b < 3; ++b) {
          const Real* from = update + (3 * j + b) * ld;
          Real* to = Column(target_[j] + b);
          for (int i = j; i < rows; ++i) {
            to[target_[i]] += from[3 * i];
            to[target_[i] + 1] += from[3 * i + 1];
            to[target_[i] + 2] += from[3 * i + 2];
          }
        }
      }
    }

    FrontWalk& walk_;
    std::vector<int32_t> local_;
    std::vector<int32_t> target_;
    Front<Real> front_;
  };

  const FrontalStructure& fronts_;
  const NodeMatrix& A_;
  const double shift_;
  const Visit& visit_;
  Workers& workers_;
  std::vector<const Real*> waiting_;  ///< update matrices that have not been added to their parents
  std::vector<std::unique_ptr<Real[]>>
      kept_;         ///< update matrices of the top, and of subtrees' roots
  double done_ = 0;  ///< flops
};

template <typename Real, typename Visit>
absl::Status FrontWalk<Real, Visit>::RunSubtree(const Subtree& subtree, Real* stack,
                                                Assembler& assembler, Workers& alone) {
  Real* top = stack;
  for (int s = subtree.begin; s < subtree.end; ++s) {
    RETURN_IF_ERROR(assembler.Process(s, top, alone));
    Real* base = top;
    for (const int child : fronts_.children(s)) base -= UpdateSize(child);
    MoveUpdate(top, fronts_.update_count(s), base);
    waiting_[s] = base;
    top = base + UpdateSize(s);
  }
  const int root = subtree.end - 1;
  kept_[root].reset(new Real[UpdateSize(root)]);
  MoveUpdate(waiting_[root], fronts_.update_count(root), kept_[root].get());
  waiting_[root] = kept_[root].get();
  return absl::OkStatus();
}

}  // namespace carillon::precompute
