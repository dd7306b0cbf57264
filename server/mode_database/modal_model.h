// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/large_allocator.h"

namespace carillon {

/// A modal model in the server's memory: unit Young's modulus, density and size (see
/// proto/carillon/v1/modal_model.proto for every array and how it scales). Immutable once made,
/// shared by all objects that sound with it.
struct ModalModel {
  std::string digest;
  int64_t revision = 0;  ///< as it is stored; see ModelSummary
  double poisson_ratio = 0;
  /// The model has every deformation mode up to this eigenvalue.
  double complete_to_eigenvalue = 0;
  std::vector<double> eigenvalues;  ///< #m, ascending
  std::vector<double> couplings;    ///< #m
  /// The sounding surface: #V vertices in metres, #T triangles, counter-clockwise from outside.
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  /// #T: the triangle of the given surface in which each triangle lies.
  std::vector<uint32_t> given_triangle;
  /// The given surface: #G vertices in metres, #H triangles.
  std::vector<std::array<float, 3>> given_vertices;
  std::vector<std::array<uint32_t, 3>> given_triangles;
  /// #V by 3 by #m, row-major: shapes[(vertex * 3 + axis) * m + mode], 1/kg^(1/2).
  std::vector<float, LargeAllocator<float>> shapes;

  size_t mode_count() const { return eigenvalues.size(); }
};

}  // namespace carillon
