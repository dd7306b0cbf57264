// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/esprit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace carillon::fit {
namespace {

using Matrix = Eigen::MatrixXcd;

/// Columns beside the wanted ones, and steps, of the subspace iteration. The eigenvalues of signals
/// are well apart from those of the noise, or else no method would find them.
constexpr Eigen::Index kSpareColumns = 4;
constexpr int kIterations = 8;

/// Adds H H^* of a signal's Hankel matrix H of `height` rows: R(i, j) = sum_k x_(i+k) conj x_(j+k),
/// in which each diagonal follows from its first element.
void AddCovariance(Signal x, Eigen::Index height, Matrix& covariance) {
  const auto columns = static_cast<Eigen::Index>(x.size()) - height + 1;
  if (columns < 1) return;
  const Eigen::Map<const Eigen::VectorXcd> all(x.data(), static_cast<Eigen::Index>(x.size()));
  for (Eigen::Index lag = 0; lag < height; ++lag) {
    // The sum over k of x_(lag + k) conj x_k.
    std::complex<double> sum = all.head(columns).dot(all.segment(lag, columns));
    for (Eigen::Index j = 0;; ++j) {
      covariance(j + lag, j) += sum;
      if (j + lag + 1 == height) break;
      sum +=
          all[j + lag + columns] * std::conj(all[j + columns]) - all[j + lag] * std::conj(all[j]);
    }
  }
}

Matrix Orthonormal(const Matrix& columns) {
  return Eigen::HouseholderQR<Matrix>(columns).householderQ() *
         Matrix::Identity(columns.rows(), columns.cols());
}

/// Returns the `count` dominant eigenvectors of a Hermitian matrix, of which the lower triangle is
/// given, the most dominant first.
Matrix Dominant(const Matrix& lower, Eigen::Index count) {
  const Matrix full = lower.selfadjointView<Eigen::Lower>();
  const Eigen::Index width = std::min(count + kSpareColumns, full.rows());
  // Columns spread over the matrix are a beginning that no signal is orthogonal to.
  Matrix basis = Matrix::Zero(full.rows(), width);
  for (Eigen::Index c = 0; c < width; ++c) basis.col(c) = full.col(c * full.rows() / width);
  for (int step = 0; step < kIterations; ++step) basis = full * Orthonormal(basis);
  basis = Orthonormal(basis);
  const Eigen::SelfAdjointEigenSolver<Matrix> within(basis.adjoint() * full * basis);
  return (basis * within.eigenvectors()).rowwise().reverse().leftCols(count);
}

}  // namespace

std::vector<std::vector<std::complex<double>>> EspritPoles(const std::vector<Signal>& signals,
                                                           int height, int most_order) {
  Matrix covariance = Matrix::Zero(height, height);
  for (const Signal& signal : signals) AddCovariance(signal, height, covariance);
  std::vector<std::vector<std::complex<double>>> poles;
  const Eigen::Index most = std::min<Eigen::Index>(most_order, height - 1);
  if (!(covariance.diagonal().real().sum() > 0)) return poles;
  const Matrix subspace = Dominant(covariance, most);
  const Matrix shifted = subspace.topRows(height - 1).adjoint() * subspace.bottomRows(height - 1);
  for (Eigen::Index order = 1; order <= most; ++order) {
    // (U1^* U1)^-1 = I + c c^* / (1 - |c|^2), because only the last row c^* of U is missing in U1.
    const Eigen::VectorXcd c = subspace.row(height - 1).head(order).adjoint();
    const double rest = std::max(1e-12, 1 - c.squaredNorm());
    const Matrix product = shifted.topLeftCorner(order, order);
    const Matrix rotation = product + c * (c.adjoint() * product) / rest;
    const Eigen::ComplexEigenSolver<Matrix> solver(rotation, false);
    if (solver.info() != Eigen::Success) continue;
    poles.emplace_back(solver.eigenvalues().begin(), solver.eigenvalues().end());
  }
  return poles;
}

std::vector<std::complex<double>> Amplitudes(Signal signal,
                                             const std::vector<std::complex<double>>& poles) {
  const auto rows = static_cast<Eigen::Index>(signal.size());
  const auto columns = static_cast<Eigen::Index>(poles.size());
  Matrix powers(rows, columns);
  powers.row(0).setOnes();
  for (Eigen::Index n = 1; n < rows; ++n) {
    for (Eigen::Index k = 0; k < columns; ++k) {
      powers(n, k) = powers(n - 1, k) * poles[static_cast<size_t>(k)];
    }
  }
  const Eigen::Map<const Eigen::VectorXcd> x(signal.data(), rows);
  const Eigen::VectorXcd a = Eigen::HouseholderQR<Matrix>(powers).solve(x);
  return {a.begin(), a.end()};
}

}  // namespace carillon::fit
