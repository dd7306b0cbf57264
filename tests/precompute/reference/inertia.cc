// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/reference/inertia.h"

#include <dmumps_c.h>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

constexpr MUMPS_INT kInitialize = -1;
constexpr MUMPS_INT kTerminate = -2;
constexpr MUMPS_INT kAnalyze = 1;
constexpr MUMPS_INT kFactorize = 2;
constexpr MUMPS_INT kUseWorldCommunicator = -987654;
constexpr MUMPS_INT kGeneralSymmetric = 2;
constexpr MUMPS_INT kWorkspaceTooSmall = -9;
constexpr MUMPS_INT kWorkspaceTooSmallForSlaves = -8;
constexpr MUMPS_INT kOutOfMemory = -13;

/// One MUMPS instance, for an LDL^T factorization whose factors are thrown away.
class LdltFactorization {
 public:
  LdltFactorization() {
    id_.par = 1;
    id_.sym = kGeneralSymmetric;
    id_.comm_fortran = kUseWorldCommunicator;
    Run(kInitialize);
    for (int k = 1; k <= 3; ++k) Control(k) = -1;  // print nothing
    Control(4) = 0;
    Control(7) = 1;    // the pivot order is given
    Control(12) = 1;   // and not to be compressed
    Control(28) = 1;   // sequential analysis
    Control(31) = 1;   // discard the factors
    Control(14) = 30;  // per cent of workspace for delayed pivots
  }
  ~LdltFactorization() { Run(kTerminate); }
  LdltFactorization(const LdltFactorization&) = delete;
  LdltFactorization& operator=(const LdltFactorization&) = delete;

  /// Number of negative pivots of a matrix given by its lower triangle.
  absl::StatusOr<int> CountNegativePivots(const SystemMatrices::Sparse& lower,
                                          const std::vector<int>& order) {
    SetMatrix(lower);
    std::vector<MUMPS_INT> position(order.size());
    for (size_t k = 0; k < order.size(); ++k) {
      position[static_cast<size_t>(order[k])] = static_cast<MUMPS_INT>(k) + 1;
    }
    id_.perm_in = position.data();
    Run(kAnalyze);
    if (Info(1) >= 0) Run(kFactorize);
    while (Info(1) == kWorkspaceTooSmall || Info(1) == kWorkspaceTooSmallForSlaves) {
      Control(14) *= 2;
      Run(kFactorize);
    }
    id_.perm_in = nullptr;
    if (Info(1) < 0) return Failure();
    return Info(12);
  }

 private:
  MUMPS_INT& Control(int number) { return id_.icntl[number - 1]; }
  MUMPS_INT Info(int number) const { return id_.infog[number - 1]; }
  void Run(MUMPS_INT job) {
    id_.job = job;
    dmumps_c(&id_);
  }

  void SetMatrix(const SystemMatrices::Sparse& lower) {
    for (int column = 0; column < lower.cols(); ++column) {
      for (SystemMatrices::Sparse::InnerIterator entry(lower, column); entry; ++entry) {
        rows_.push_back(static_cast<MUMPS_INT>(entry.row()) + 1);
        columns_.push_back(column + 1);
        values_.push_back(entry.value());
      }
    }
    id_.n = static_cast<MUMPS_INT>(lower.cols());
    id_.nnz = static_cast<MUMPS_INT8>(values_.size());
    id_.irn = rows_.data();
    id_.jcn = columns_.data();
    id_.a = values_.data();
  }

  absl::Status Failure() const {
    if (Info(1) == kOutOfMemory) {
      return Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
                     "the memory does not suffice to count the modes; ask for fewer nodes");
    }
    return Refusal(
        absl::StatusCode::kInternal, "VERIFICATION_FAILED",
        absl::StrCat("the modes could not be counted: the factorization ended with code ", Info(1),
                     "; another number of nodes may do"));
  }

  DMUMPS_STRUC_C id_{};
  std::vector<MUMPS_INT> rows_;
  std::vector<MUMPS_INT> columns_;
  std::vector<double> values_;
};

}  // namespace

absl::StatusOr<int> CountEigenvaluesBelow(const SystemMatrices& system, double shift,
                                          const std::vector<int>& order) {
  const SystemMatrices::Sparse shifted = system.K - shift * system.M;
  return LdltFactorization().CountNegativePivots(shifted, order);
}

}  // namespace carillon::precompute
