// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/radiation/acoustic_surface.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The correction of the vertex rule for a pair of vertices and the static kernel 1/(4 pi r). The
/// correction is the difference between the exact Galerkin integrals over triangles that are near
/// each other and the vertex rule for the same triangles. Rows are test functions.
struct NearEntry {
  float double_layer = 0;             ///< K
  float single_layer = 0;             ///< V with n . n'
  float curls = 0;                    ///< V with curl . curl'
  std::array<float, 3> source = {};   ///< V times n', to be multiplied by the displacement
  std::array<float, 3> adjoint = {};  ///< K' times n' of the entry with row and column swapped
};

/// A sparse matrix of near entries by rows, and the exact diagonals. They are valid for every
/// wavenumber.
struct NearCorrection {
  std::vector<int64_t> row_begin;  ///< #vertices + 1
  std::vector<int32_t> columns;    ///< ascending in each row
  std::vector<NearEntry> entries;
  /// The exact static diagonals of K, of V with n . n', and of V with curl . curl'; #vertices each.
  std::vector<double> double_layer, single_layer, curls;
};

NearCorrection MakeNearCorrection(const AcousticSurface& surface, Workers& workers);

}  // namespace carillon::precompute
