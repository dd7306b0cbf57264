// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <functional>
#include <span>
#include <vector>

#include "precompute/radiation/acoustic_surface.h"

namespace carillon::precompute {

struct GmresOptions {
  double tolerance = 1e-2;  ///< limit of the residual, relative to the right side
  int max_iterations = 200;
};

struct GmresSolution {
  std::vector<ComplexFloat> x;
  double residual = 0;  ///< relative, as computed by the iteration
  int iterations = 0;
};

/// Computes results[s] = A inputs[s] for one or more vectors.
using ApplyMatrix = std::function<void(std::span<const std::vector<ComplexFloat>> inputs,
                                       std::span<std::vector<ComplexFloat>> results)>;

/// Solves A x_s = b_s by GMRES (Saad and Schultz 1986) with right preconditioning by the diagonal.
/// Several right sides are iterated together, and `apply` gets one vector for each side that has
/// not converged. `starts` are the first guesses; if empty, they are zero.
std::vector<GmresSolution> SolveGmres(const ApplyMatrix& apply,
                                      std::span<const ComplexFloat> diagonal,
                                      std::span<const std::vector<ComplexFloat>> right_sides,
                                      std::span<const std::vector<ComplexFloat>> starts,
                                      const GmresOptions& options);

}  // namespace carillon::precompute
