// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/cholesky_factor.h"

#include <cholmod.h>

#include <algorithm>
#include <utility>

#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// CHOLMOD's view of a lower triangle, without a copy.
cholmod_sparse View(const SystemMatrices::Sparse& lower) {
  cholmod_sparse view{};
  view.nrow = static_cast<size_t>(lower.rows());
  view.ncol = static_cast<size_t>(lower.cols());
  view.nzmax = static_cast<size_t>(lower.nonZeros());
  view.p = const_cast<int*>(lower.outerIndexPtr());
  view.i = const_cast<int*>(lower.innerIndexPtr());
  view.x = const_cast<double*>(lower.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

absl::Status Failure(int status) {
  if (status == CHOLMOD_OUT_OF_MEMORY) {
    return Refusal(
        absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
        "the memory does not suffice to factor the stiffness matrix; ask for fewer nodes");
  }
  if (status == CHOLMOD_TOO_LARGE) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_TOO_LARGE",
                   "the factor of the stiffness matrix would exceed 16 GB; ask for fewer nodes");
  }
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 "the shifted stiffness matrix is not positive definite, as happens with elements "
                 "that are nearly flat; another number of nodes may do");
}

}  // namespace

struct CholeskyFactor::Insides {
  Insides() {
    cholmod_start(&common);
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_ll = 1;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    common.print = 0;
  }
  ~Insides() {
    cholmod_free_dense(&solution, &common);
    cholmod_free_dense(&workspace, &common);
    cholmod_free_dense(&scratch, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Insides(const Insides&) = delete;
  Insides& operator=(const Insides&) = delete;

  absl::Status Factor(const SystemMatrices::Sparse& lower, const std::vector<int>& given) {
    cholmod_sparse view = View(lower);
    factor = cholmod_analyze_p(&view, const_cast<int*>(given.data()), nullptr, 0, &common);
    if (factor != nullptr) cholmod_factorize(&view, factor, &common);
    if (common.status != CHOLMOD_OK) return Failure(common.status);
    const auto* permutation = static_cast<const int*>(factor->Perm);
    order.assign(permutation, permutation + lower.rows());
    return absl::OkStatus();
  }

  void Solve(int system, Eigen::Ref<Eigen::MatrixXd>& X) {
    cholmod_dense right{};
    right.nrow = static_cast<size_t>(X.rows());
    right.ncol = static_cast<size_t>(X.cols());
    right.d = static_cast<size_t>(X.outerStride());
    right.nzmax = right.d * right.ncol;
    right.x = X.data();
    right.xtype = CHOLMOD_REAL;
    right.dtype = CHOLMOD_DOUBLE;
    cholmod_solve2(system, factor, &right, nullptr, &solution, nullptr, &workspace, &scratch,
                   &common);
    X = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(solution->x), X.rows(),
                                          X.cols());
  }

  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense* solution = nullptr;  // reused by later calls, so that CHOLMOD need not allocate
  cholmod_dense* workspace = nullptr;
  cholmod_dense* scratch = nullptr;
  std::vector<int> order;
};

CholeskyFactor::CholeskyFactor(std::unique_ptr<Insides> insides) : insides_(std::move(insides)) {}
CholeskyFactor::CholeskyFactor(CholeskyFactor&&) noexcept = default;
CholeskyFactor::~CholeskyFactor() = default;

absl::StatusOr<CholeskyFactor> CholeskyFactor::Make(const SystemMatrices::Sparse& lower,
                                                    const std::vector<int>& order) {
  auto insides = std::make_unique<Insides>();
  RETURN_IF_ERROR(insides->Factor(lower, order));
  return CholeskyFactor(std::move(insides));
}

void CholeskyFactor::SolveL(Eigen::Ref<Eigen::MatrixXd> X) const { insides_->Solve(CHOLMOD_L, X); }

void CholeskyFactor::SolveLTransposed(Eigen::Ref<Eigen::MatrixXd> X) const {
  insides_->Solve(CHOLMOD_Lt, X);
}

const std::vector<int>& CholeskyFactor::order() const { return insides_->order; }

}  // namespace carillon::precompute
