// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/block_lanczos.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>
#include <utility>

namespace carillon::precompute {

using Eigen::Index;
using Eigen::MatrixXd;

template <typename Real>
LanczosRecurrence<Real>::LanczosRecurrence(const NodeMatrix& A,
                                           const MultifrontalCholesky<Real>& factor, double shift,
                                           const MatrixXd& deflated, double expected_size,
                                           Workers& workers)
    : workers_(workers),
      expected_size_(expected_size),
      mass_(MakeMassRows<Real>(A)),
      operator_(A, factor, mass_, shift, workers),
      mass_is_identity_(A.mass_is_identity),
      rows_(3 * static_cast<Index>(A.node_count)),
      deflated_(rows_, workers),
      basis_(rows_, workers),
      next_(rows_, kBlockWidth) {
  Block block = Block::Zero(rows_, kBlockWidth);
  block.leftCols(deflated.cols()) = deflated.cast<Real>();
  deflated_.Append(std::move(block));
  if (!mass_is_identity_) mass_times_.resize(rows_, kBlockWidth);
}

template <typename Real>
bool LanczosRecurrence<Real>::Start() {
  std::mt19937 random(20020721);
  constexpr auto kHalf = static_cast<Real>(1U << 31);
  std::generate_n(next_.data(), next_.size(),
                  [&] { return static_cast<Real>(random()) / kHalf - 1; });
  Orthogonalize();
  return Normalize();
}

template <typename Real>
bool LanczosRecurrence<Real>::Step() {
  basis_.Append(std::move(next_));
  below_.emplace_back(R_);
  operator_.Apply(mass_is_identity_ ? basis_.back(0) : mass_times_, next_, done());
  // The recurrence removes the large components first, so that the remainder loses no digits when
  // it is orthogonalized against the whole basis.
  const SmallBlock H = BlockBasis<Real>::Dot(basis_.back(0), MassTimes(next_), workers_);
  basis_.SubtractBlock(0, H, next_);
  if (basis_.size() > kBlockWidth) basis_.SubtractBlock(1, R_.transpose(), next_);
  diagonal_.emplace_back((H + H.transpose()) / 2);
  Orthogonalize();
  return Normalize();
}

template <typename Real>
MatrixXd LanczosRecurrence<Real>::T() const {
  MatrixXd T = MatrixXd::Zero(size(), size());
  for (size_t j = 0; j < diagonal_.size(); ++j) {
    const auto at = static_cast<Index>(j) * kBlockWidth;
    T.block<kBlockWidth, kBlockWidth>(at, at) = diagonal_[j];
    if (j == 0) continue;
    T.block<kBlockWidth, kBlockWidth>(at, at - kBlockWidth) = below_[j];
    T.block<kBlockWidth, kBlockWidth>(at - kBlockWidth, at) = below_[j].transpose();
  }
  return T;
}

/// M x, valid until the next call.
template <typename Real>
const typename LanczosRecurrence<Real>::Block& LanczosRecurrence<Real>::MassTimes(const Block& x) {
  if (mass_is_identity_) return x;
  MultiplyMass(mass_, workers_, x.data(), mass_times_.data());
  return mass_times_;
}

template <typename Real>
void LanczosRecurrence<Real>::Orthogonalize() {
  const Block& mass_times = MassTimes(next_);
  const Coefficients rigid = deflated_.Project(mass_times);
  const Coefficients h = basis_.Project(mass_times);
  deflated_.Subtract(rigid, next_);
  basis_.Subtract(h, next_);
}

/// next = q R with q^T M q = 1 and R upper triangular: Cholesky QR, twice.
template <typename Real>
bool LanczosRecurrence<Real>::Normalize() {
  R_.setIdentity();
  const Block& mass_times = MassTimes(next_);
  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::LLT<SmallBlock> llt(BlockBasis<Real>::Dot(next_, mass_times, workers_));
    if (llt.info() != Eigen::Success) return false;
    const SmallBlock upper = llt.matrixU();
    const SmallBlock inverse =
        upper.triangularView<Eigen::Upper>().solve(SmallBlock(SmallBlock::Identity()));
    TimesRight(inverse, next_);
    if (!mass_is_identity_) TimesRight(inverse, mass_times_);
    R_ = upper * R_;
  }
  return true;
}

/// x = x u
template <typename Real>
void LanczosRecurrence<Real>::TimesRight(const SmallBlock& u, Block& x) {
  constexpr int64_t kStretch = 256;
  const SmallBlockOf<Real> minus = (-u).template cast<Real>();
  workers_.ForParts(rows_, kStretch, [&](int64_t begin, int64_t end, int) {
    std::vector<Real> copy(kStretch * kBlockWidth);
    for (int64_t i = begin; i < end; i += kStretch) {
      const int64_t count = std::min(kStretch, end - i);
      Real* rows = x.data() + i * kBlockWidth;
      std::copy_n(rows, count * kBlockWidth, copy.data());
      std::fill_n(rows, count * kBlockWidth, Real{0});
      BlockSubtractTimes(copy.data(), minus.data(), count, rows);
    }
  });
}

template class LanczosRecurrence<float>;
template class LanczosRecurrence<double>;

}  // namespace carillon::precompute
