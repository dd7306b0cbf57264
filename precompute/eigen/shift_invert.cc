// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/shift_invert.h"

#include <algorithm>
#include <type_traits>

#include "precompute/eigen/residual_kernels.h"

namespace carillon::precompute {
namespace {

/// Measured: with a relative error of a solve of 1e-5 (bunnies), refining in a seventh of the
/// iteration suffices for residuals of 4e-7 after two corrections. With 1e-4 to 1.4e-3 (tubes,
/// quadratic elements) three fifths to three quarters are needed. With less, the modes contain
/// components of higher modes that corrections hardly remove.
constexpr double kSmallSolveError = 1.5e-5;
constexpr double kRefinedPart = 0.15;
constexpr double kRefinedPartOfCoarse = 0.75;

}  // namespace

template <typename Real>
ShiftInvert<Real>::ShiftInvert(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor,
                               const MassRows<Real>& mass, double shift, Workers& workers)
    : A_(A),
      factor_(factor),
      mass_(mass),
      shift_(shift),
      workers_(workers),
      solution_(3 * static_cast<Eigen::Index>(A.node_count), kBlockWidth) {}

template <typename Real>
void ShiftInvert<Real>::Apply(const Block& x, Block& y, double done) {
  std::copy_n(x.data(), x.size(), solution_.data());
  factor_.Solve(solution_.data(), workers_);
  if (std::is_same_v<Real, float> && done < refined_part_) {
    Refine(x);
    refined_part_ = error_ > kSmallSolveError ? kRefinedPartOfCoarse : kRefinedPart;
    y = (solution_ + y_) * static_cast<Real>(-shift_);
  } else {
    y = solution_ * static_cast<Real>(-shift_);
  }
}

/// Solves for the residual of solution_ with right-hand side x. Afterwards solution_ is the
/// improvement, and y_ is the previous solution.
template <typename Real>
void ShiftInvert<Real>::Refine(const Block& x) {
  elastic_.resize(x.rows(), kBlockWidth);
  y_.resize(x.rows(), kBlockWidth);
  y_.swap(solution_);
  MultiplyStiffness(A_, y_.data(), elastic_.data());
  if (!A_.mass_is_identity) {
    inertial_.resize(x.rows(), kBlockWidth);
    MultiplyMass(mass_, workers_, y_.data(), inertial_.data());
  }
  StoreSolveResidual(x.data(), elastic_.data(), (A_.mass_is_identity ? y_ : inertial_).data(),
                     shift_, x.size(), solution_.data());
  factor_.Solve(solution_.data(), workers_);
  if (error_ == 0) error_ = solution_.norm() / y_.norm();
}

template class ShiftInvert<float>;
template class ShiftInvert<double>;

}  // namespace carillon::precompute
