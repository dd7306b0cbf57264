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
/// formula). The vertex rule serves all integrals, and NearCorrection puts right what it misses
/// near by. No matrix is stored.
class BoundaryOperator {
 public:
  /// Keeps the references. `center` and `radius_m`: of a sphere around the surface.
  BoundaryOperator(const AcousticSurface& surface, const NearCorrection& near, const Point& center,
                   double radius_m, double wavenumber);

  size_t size() const { return surface_.vertex_count(); }

  /// The left side, of one or two pressures at once: results[s] = A pressures[s].
  void Apply(std::span<const std::vector<ComplexFloat>> pressures,
             std::span<std::vector<ComplexFloat>> results, Workers& workers) const;

  /// The right side, of one or two displacements.
  std::vector<std::vector<ComplexFloat>> RightSides(std::span<const Displacement> displacements,
                                                    Workers& workers) const;

  /// The diagonal of the left side, near enough to precondition with.
  std::vector<ComplexFloat> Diagonal() const;

 private:
  /// To the results of the rows from first to before second.
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
