// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "precompute/radiation/acoustic_surface.h"
#include "precompute/radiation/near_correction.h"
#include "precompute/radiation/sweep_kernels.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Displacement of each vertex.
using Displacement = std::vector<std::array<float, 3>>;

/// The equation of Burton and Miller for the pressure p on a surface that moves with
/// dp/dn = q = n . displacement, at one wavenumber k and time exp(-i omega t):
///
///     (M/2 - K - eta N) p = -(V + eta (M/2 + K')) q,     eta = i / max(k, 1/R)
///
/// in Galerkin's form with P1 functions (Burton and Miller, Proc. R. Soc. A 323, 1971; N by Maue's
/// formula). All integrals use the vertex rule, and NearCorrection corrects its errors for near
/// pairs. No dense matrix is stored.
class BoundaryOperator {
 public:
  /// Keeps references to the arguments, which must outlive the operator. `center` and `radius_m`
  /// describe a sphere around the surface.
  BoundaryOperator(const AcousticSurface& surface, const NearCorrection& near, const Point& center,
                   double radius_m, double wavenumber);

  size_t size() const { return surface_.vertex_count(); }

  /// Computes the left side of one or two pressures at once: results[s] = A pressures[s].
  void Apply(std::span<const std::vector<ComplexFloat>> pressures,
             std::span<std::vector<ComplexFloat>> results, Workers& workers) const;

  /// Returns the right sides of one or two displacements.
  std::vector<std::vector<ComplexFloat>> RightSides(std::span<const Displacement> displacements,
                                                    Workers& workers) const;

  /// Returns an approximate diagonal of the left side, for preconditioning.
  std::vector<ComplexFloat> Diagonal() const;

 private:
  /// Adds the near corrections to `result` in the rows from rows.first to rows.second - 1.
  void AddNear(std::span<const ComplexFloat> p, std::pair<int64_t, int64_t> rows,
               std::span<ComplexFloat> result) const;
  void AddMass(std::span<const ComplexFloat> p, std::span<ComplexFloat> result) const;

  const AcousticSurface& surface_;
  const NearCorrection& near_;
  double wavenumber_;
  double eta_;    ///< imaginary part of eta
  double scale_;  ///< k / pi, 1/m
  SweepTargets targets_;
};

}  // namespace carillon::precompute
