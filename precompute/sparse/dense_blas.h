// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cblas.h>
#include <lapacke.h>

namespace carillon::precompute::blas {

// The dense kernels that a front needs, in both precisions. All matrices are column-major.

/// Factorizes A = L L^T in place, in the lower triangle. Returns whether A was positive definite.
inline bool Cholesky(int n, double* A, int ld) {
  return LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', n, A, ld) == 0;
}
inline bool Cholesky(int n, float* A, int ld) {
  return LAPACKE_spotrf_work(LAPACK_COL_MAJOR, 'L', n, A, ld) == 0;
}

/// Computes B = B L^-T for B, `rows` by n.
inline void SolveRight(int rows, int n, const double* L, int ldl, double* B, int ldb) {
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows, n, 1.0, L, ldl,
              B, ldb);
}
inline void SolveRight(int rows, int n, const float* L, int ldl, float* B, int ldb) {
  cblas_strsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows, n, 1.0F, L,
              ldl, B, ldb);
}

/// Computes the lower triangle of C -= A A^T for A, n by k.
inline void SubtractSquare(int n, int k, const double* A, int lda, double* C, int ldc) {
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n, k, -1.0, A, lda, 1.0, C, ldc);
}
inline void SubtractSquare(int n, int k, const float* A, int lda, float* C, int ldc) {
  cblas_ssyrk(CblasColMajor, CblasLower, CblasNoTrans, n, k, -1.0F, A, lda, 1.0F, C, ldc);
}

/// Computes C -= A B^T for A, m by k, and B, n by k.
inline void SubtractProduct(int m, int n, int k, const double* A, int lda, const double* B, int ldb,
                            double* C, int ldc) {
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, m, n, k, -1.0, A, lda, B, ldb, 1.0, C, ldc);
}

inline void SubtractProduct(int m, int n, int k, const float* A, int lda, const float* B, int ldb,
                            float* C, int ldc) {
  cblas_sgemm(CblasColMajor, CblasNoTrans, CblasTrans, m, n, k, -1.0F, A, lda, B, ldb, 1.0F, C,
              ldc);
}

/// Computes C = A^T B for A, k by m, and B, k by n.
inline void TransposedProduct(int m, int n, int k, const double* A, int lda, const double* B,
                              int ldb, double* C, int ldc) {
  cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, m, n, k, 1.0, A, lda, B, ldb, 0.0, C, ldc);
}

/// Computes C = A B for A, m by k, and B, k by n.
inline void Product(int m, int n, int k, const double* A, int lda, const double* B, int ldb,
                    double* C, int ldc) {
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, m, n, k, 1.0, A, lda, B, ldb, 0.0, C, ldc);
}

/// Computes the eigenvalues of a symmetric matrix A, ascending. A is given by its lower triangle
/// and overwritten by its eigenvectors. Returns false if the iteration did not converge.
inline bool SymmetricEigen(int n, double* A, double* eigenvalues) {
  return LAPACKE_dsyevd(LAPACK_COL_MAJOR, 'V', 'L', n, A, n, eigenvalues) == 0;
}

/// Computes the eigenvalues and eigenvectors of A x = lambda B x in the same way, for positive
/// definite B.
inline bool GeneralizedEigen(int n, double* A, double* B, double* eigenvalues) {
  return LAPACKE_dsygvd(LAPACK_COL_MAJOR, 1, 'V', 'L', n, A, n, B, n, eigenvalues) == 0;
}

}  // namespace carillon::precompute::blas
