// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/block_lanczos_eigensolver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "absl/strings/str_cat.h"
#include "precompute/modes/block_basis.h"
#include "precompute/modes/multifrontal_cholesky.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// On |K phi - Lambda M phi| / |Lambda M phi|, Euclidean, as estimated while iterating.
constexpr double kTolerance = 2e-7;

/// The shift, as a part of the highest eigenvalue wanted: 2 kHz for a band to 20 kHz. The count of
/// iterations hardly depends on it.
constexpr double kShift = -0.01;

/// Rows of `x` (order of the unknowns) in elimination order, or back.
MatrixXd ToEliminationOrder(const MatrixXd& x, const std::vector<int32_t>& order) {
  MatrixXd y(x.rows(), x.cols());
  for (size_t i = 0; i < order.size(); ++i) {
    y.middleRows<3>(3 * static_cast<Index>(i)) = x.middleRows<3>(3 * static_cast<Index>(order[i]));
  }
  return y;
}
MatrixXd FromEliminationOrder(const MatrixXd& x, const std::vector<int32_t>& order) {
  MatrixXd y(x.rows(), x.cols());
  for (size_t i = 0; i < order.size(); ++i) {
    y.middleRows<3>(3 * static_cast<Index>(order[i])) = x.middleRows<3>(3 * static_cast<Index>(i));
  }
  return y;
}

/// The three-term recurrence  OP q_j = q_{j-1} R_j^T + q_j H_j + q_{j+1} R_{j+1}  with
/// OP = (K - shift M)^-1 M, in the inner product of M.
class LanczosRecurrence {
 public:
  LanczosRecurrence(const NodeMatrix& A, const MultifrontalCholesky<double>& factor,
                    const MatrixXd& deflated)
      : A_(A),
        factor_(factor),
        rows_(3 * static_cast<Index>(A.node_count)),
        deflated_(rows_),
        basis_(rows_),
        next_(rows_, kBlockWidth),
        mass_times_(rows_, kBlockWidth),
        solution_(rows_ + 3, kBlockWidth) {
    VectorBlock block = VectorBlock::Zero(rows_, kBlockWidth);
    block.leftCols(deflated.cols()) = deflated;
    deflated_.Append(block);
  }

  /// Starts with random vectors, seeded: a body gives the same model each time.
  bool Start() {
    std::mt19937 random(20020721);
    std::normal_distribution<double> normal;
    std::generate_n(next_.data(), next_.size(), [&] { return normal(random); });
    Orthogonalize();
    return Normalize();
  }

  /// Adds one block to the basis and to T. False: the Krylov space is exhausted.
  bool Step() {
    basis_.Append(next_);
    const SmallBlock R_before = R_;
    MultiplyMass(A_, next_.data(), solution_.data());
    factor_.Solve(solution_.data());
    next_ = solution_.topRows(rows_);
    const SmallBlock H = Recur();
    Extend((H + H.transpose()) / 2, R_before);
    Orthogonalize();
    return Normalize();
  }

  const MatrixXd& T() const { return T_; }
  const BlockBasis& basis() const { return basis_; }

  /// G^T G with G = (K - shift M) q_{j+1} R_{j+1}, of what the last block still lacks.
  SmallBlock ShiftedStiffnessOfRemainder(double shift) const {
    VectorBlock G(rows_, kBlockWidth);
    VectorBlock mass_times(rows_, kBlockWidth);
    MultiplyStiffness(A_, next_.data(), G.data());
    MultiplyMass(A_, next_.data(), mass_times.data());
    G -= shift * mass_times;
    return R_.transpose() * BlockBasis::Dot(G, G) * R_;
  }

  /// About |M y| for y^T M y = 1.
  double mass_scale() const {
    double diagonal = 0;
    for (int j = 0; j < A_.node_count; ++j) {
      diagonal += A_.mass[static_cast<size_t>(A_.column_start[static_cast<size_t>(j)])];
    }
    return std::sqrt(diagonal / A_.node_count);
  }

 private:
  SmallBlock Recur() {
    MultiplyMass(A_, next_.data(), mass_times_.data());
    SmallBlock H = BlockBasis::Dot(basis_.back(0), mass_times_);
    BlockSubtractTimes(basis_.back(0).data(), H.data(), rows_, next_.data());
    if (basis_.size() > kBlockWidth) {
      const SmallBlock transposed = R_.transpose();
      BlockSubtractTimes(basis_.back(1).data(), transposed.data(), rows_, next_.data());
    }
    return H;
  }

  void Extend(const SmallBlock& H, const SmallBlock& R) {
    const Index n = basis_.size();
    T_.conservativeResizeLike(MatrixXd::Zero(n, n));
    T_.bottomRightCorner<kBlockWidth, kBlockWidth>() = H;
    if (n == kBlockWidth) return;
    T_.block<kBlockWidth, kBlockWidth>(n - kBlockWidth, n - 2 * kBlockWidth) = R;
    T_.block<kBlockWidth, kBlockWidth>(n - 2 * kBlockWidth, n - kBlockWidth) = R.transpose();
  }

  /// Against everything, once: the recurrence has taken the large parts out already.
  void Orthogonalize() {
    MultiplyMass(A_, next_.data(), mass_times_.data());
    deflated_.Subtract(deflated_.Project(mass_times_), next_);
    basis_.Subtract(basis_.Project(mass_times_), next_);
  }

  /// next = q R with q^T M q = 1 and R upper triangular: Cholesky QR, twice.
  bool Normalize() {
    R_.setIdentity();
    for (int pass = 0; pass < 2; ++pass) {
      MultiplyMass(A_, next_.data(), mass_times_.data());
      const SmallBlock gram = BlockBasis::Dot(next_, mass_times_);
      const Eigen::LLT<SmallBlock> llt(gram);
      if (llt.info() != Eigen::Success) return false;
      const SmallBlock upper = llt.matrixU();
      // next upper^-1 = next - next (1 - upper^-1)
      const SmallBlock change =
          SmallBlock::Identity() -
          SmallBlock(upper.triangularView<Eigen::Upper>().solve(SmallBlock::Identity()));
      mass_times_ = next_;
      BlockSubtractTimes(mass_times_.data(), change.data(), rows_, next_.data());
      R_ = upper * R_;
    }
    return true;
  }

  const NodeMatrix& A_;
  const MultifrontalCholesky<double>& factor_;
  Index rows_;
  BlockBasis deflated_;
  BlockBasis basis_;
  VectorBlock next_;
  VectorBlock mass_times_;
  VectorBlock solution_;
  SmallBlock R_ = SmallBlock::Zero();
  MatrixXd T_;
};

/// The Ritz pairs of a recurrence, of the lowest Lambda first.
struct RitzPairs {
  VectorXd eigenvalues;
  MatrixXd coordinates;
  int converged_count = 0;
};

/// With y = Q s a Ritz vector of OP and theta its value, OP y - theta y = q R s_last, so that
/// K y - Lambda M y = -(K - shift M) q R s_last / theta. |M y| is taken from the mean mass of a
/// node.
RitzPairs FindRitzPairs(const LanczosRecurrence& recurrence, double shift, Index wanted) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(recurrence.T());
  const VectorXd theta = solver.eigenvalues().tail(wanted).reverse();
  const SmallBlock stiffness = recurrence.ShiftedStiffnessOfRemainder(shift);
  RitzPairs pairs;
  pairs.coordinates = solver.eigenvectors().rightCols(wanted).rowwise().reverse();
  pairs.eigenvalues = shift + theta.array().inverse();
  for (Index i = 0; i < wanted; ++i) {
    const Eigen::Matrix<double, kBlockWidth, 1> last = pairs.coordinates.col(i).tail(kBlockWidth);
    const double residual = std::sqrt(last.dot(stiffness * last)) / theta[i];
    const double scale = std::max(pairs.eigenvalues[i], -shift) * recurrence.mass_scale();
    if (!(theta[i] > 0 && residual < kTolerance * scale)) break;
    ++pairs.converged_count;
  }
  return pairs;
}

absl::Status NotConverged(int converged, Index wanted) {
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat("the eigenvalue iteration found ", converged, " of ", wanted,
                              " modes; another number of nodes may do"));
}

}  // namespace

absl::StatusOr<Modes> BlockLanczosEigensolver::Solve(const SystemMatrices& system,
                                                     const ModeRequest& request,
                                                     const SolveProgress& progress) {
  const Index wanted = request.count - rigid_.cols();
  const double shift = kShift * request.eigenvalue_limit;
  const absl::StatusOr<MultifrontalCholesky<double>> factor =
      MultifrontalCholesky<double>::Factorize(ordered_.fronts, ordered_.matrix, shift, nullptr);
  if (!factor.ok()) return factor.status();
  const MatrixXd rigid = ToEliminationOrder(rigid_, ordered_.fronts.order);
  LanczosRecurrence recurrence(ordered_.matrix, *factor, rigid);
  const Index largest = std::min<Index>(system.unknown_count() - rigid_.cols(), 10 * wanted + 500);
  RitzPairs pairs;
  bool open = recurrence.Start();
  for (Index looked = 0; pairs.converged_count < wanted;) {
    if (!open || recurrence.basis().size() + kBlockWidth > largest) {
      return NotConverged(pairs.converged_count, wanted);
    }
    open = recurrence.Step();
    const Index size = recurrence.basis().size();
    // Looking costs the cube of the size.
    if (open && size < std::max(wanted + kBlockWidth, looked + looked / 12)) continue;
    looked = size;
    pairs = FindRitzPairs(recurrence, shift, wanted);
    progress(static_cast<double>(pairs.converged_count) / static_cast<double>(wanted));
  }
  const MatrixXd shapes = recurrence.basis().Combine(pairs.coordinates);
  Modes modes;
  modes.eigenvalues.resize(request.count);
  modes.eigenvalues
      << (rigid_.transpose() * (system.K.selfadjointView<Eigen::Lower>() * rigid_)).diagonal(),
      pairs.eigenvalues;
  modes.shapes.resize(system.unknown_count(), request.count);
  modes.shapes << rigid_, FromEliminationOrder(shapes, ordered_.fronts.order);
  return modes;
}

}  // namespace carillon::precompute
