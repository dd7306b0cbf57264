// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>

namespace carillon::precompute {

// Kernels for residuals of blocks of vectors x with their products K x and M x. Each kernel makes
// one pass over memory, and its variant for the machine is chosen at run time. Blocks are `rows` by
// kBlockWidth, row-major, with three rows for each node. `energy`, `mass`, `quotient`, `residual`
// and `scale` have kBlockWidth numbers, one for each vector.

/// Computes energy += x . elastic and mass += x . inertial.
void AddRayleighSums(const double* x, const double* elastic, const double* inertial, int64_t rows,
                     double* energy, double* mass);

/// Computes residual += |D^1/2 (elastic - inertial quotient)|^2 and scale += |D^1/2 inertial|^2.
/// D^1/2 converts products from the scaled unknowns of NodeMatrix to those of K and M. `root_mass`
/// is the diagonal of D^1/2 (NodeMatrix::root_mass).
void AddResidualSums(const double* quotient, const double* root_mass, const double* elastic,
                     const double* inertial, int64_t nodes, double* residual, double* scale);

/// Computes out = elastic - inertial quotient. Here and in SubtractChange, `stride` is the
/// distance, in numbers, between the rows of `out` or `change`.
template <typename Real>
void StoreResidual(const double* quotient, const double* elastic, const double* inertial,
                   int64_t rows, int64_t stride, Real* out);

/// Computes out = right - (elastic - shift inertial), the residual of a solve for `right`. All
/// arrays have `count` numbers.
template <typename Real>
void StoreSolveResidual(const Real* right, const double* elastic, const Real* inertial,
                        double shift, int64_t count, Real* out);

/// Computes x -= change.
template <typename Real>
void SubtractChange(const Real* change, int64_t stride, int64_t rows, double* x);

}  // namespace carillon::precompute
