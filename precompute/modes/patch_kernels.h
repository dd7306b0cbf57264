// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace carillon::precompute {

/// How the motion of a node counts for the residual at a place.
struct PatchBlock {
  std::array<double, 9> stiffness = {};  ///< a(b, phi), a 3 by 3 block, row-major
  double mass = 0;                       ///< m(b, phi), the same for each direction
};

/// The nodes that count for the residual at a place, and the block of each.
struct Patch {
  std::span<const int32_t> nodes;
  const PatchBlock* blocks;
};

/// The shapes of some modes: three rows for each node, row-major, and the modes' eigenvalues.
struct ShapeRows {
  const double* shapes;
  const double* eigenvalues;
  int64_t mode_count;  ///< a multiple of kBlockWidth, also the length of a row
};

/// Computes part = r^T A r for each mode, with r = sum over nodes of (stiffness - mass Lambda)
/// times the node's rows of the shapes, and adds it to `sums`. `A` is symmetric, 3 by 3. `parts`
/// and `sums` have a number for each mode. The variant for the machine is chosen at run time.
void AddPatchParts(const Patch& patch, const std::array<double, 9>& A, const ShapeRows& rows,
                   double* sums, float* parts);

/// Adds volume_m3 (div u)^2 of each mode to `sums`, where `gradients` has three numbers for each
/// node of an element: the gradient of its function at a point.
void AddSquaredDivergences(std::span<const int32_t> nodes, const double* gradients,
                           double volume_m3, const ShapeRows& rows, double* sums);

}  // namespace carillon::precompute
