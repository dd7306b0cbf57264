// SPDX-License-Identifier: Apache-2.0
//
// What people write with Spectra: shift-invert Lanczos with a factorization of Eigen's.
//
//     spectra_peer FOLDER COUNT SHIFT TOLERANCE
//
// reads the matrices of FOLDER and finds the COUNT eigenvalues next above SHIFT, which is below
// all.

#include <Spectra/MatOp/SparseSymMatProd.h>
#include <Spectra/SymGEigsShiftSolver.h>

#include <Eigen/SparseCholesky>
#include <cstdlib>
#include <exception>
#include <string>

#include "tests/benchmarks/decomposition/matrix_file.h"

namespace carillon {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using MassProduct = Spectra::SparseSymMatProd<double, Eigen::Lower>;

/// y = (K - sigma M)^-1 x by a factorization of Eigen's.
class FactorizedInverse {
 public:
  using Scalar = double;

  FactorizedInverse(const Sparse& K, const Sparse& M) : K_(K), M_(M) {}

  Eigen::Index rows() const { return K_.rows(); }
  Eigen::Index cols() const { return K_.rows(); }
  void set_shift(double sigma) { factorization_.compute(K_ - sigma * M_); }
  void perform_op(const double* x, double* y) const {
    Eigen::Map<Eigen::VectorXd>(y, rows()) =
        factorization_.solve(Eigen::Map<const Eigen::VectorXd>(x, rows()));
  }

 private:
  const Sparse& K_;
  const Sparse& M_;
  Eigen::SimplicialLDLT<Sparse> factorization_;
};

int Solve(const std::string& folder, int count, double shift, double tolerance) {
  const Sparse K = ReadSparse(folder + "/K");
  const Sparse M = ReadSparse(folder + "/M");
  const Stopwatch watch;
  FactorizedInverse inverse(K, M);
  MassProduct mass(M);
  Spectra::SymGEigsShiftSolver<FactorizedInverse, MassProduct, Spectra::GEigsMode::ShiftInvert>
      solver(inverse, mass, count, 2 * count + 20, shift);
  solver.init();
  solver.compute(Spectra::SortRule::LargestMagn, 1000, tolerance, Spectra::SortRule::SmallestAlge);
  if (solver.info() != Spectra::CompInfo::Successful) return EXIT_FAILURE;
  const Eigen::VectorXd eigenvalues = solver.eigenvalues();
  const Eigen::MatrixXd shapes = solver.eigenvectors();
  Report(watch, folder, eigenvalues, shapes);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) try {
  if (argc != 5) {
    std::fputs("usage: spectra_peer FOLDER COUNT SHIFT TOLERANCE\n", stderr);
    return EXIT_FAILURE;
  }
  return carillon::Solve(argv[1], std::atoi(argv[2]), std::atof(argv[3]), std::atof(argv[4]));
} catch (const std::exception& error) {
  std::fprintf(stderr, "spectra_peer: %s\n", error.what());
  return EXIT_FAILURE;
}
