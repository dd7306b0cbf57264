// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/large_allocator.h"

namespace carillon {

/// A modal model in the server's memory, for unit Young's modulus, density and size.
/// proto/carillon/v1/modal_model.proto states how each array scales. A model is immutable, and all
/// objects that sound with it share it.
struct ModalModel {
  std::string digest;
  int64_t revision = 0;  ///< revision of the stored model; see ModelSummary
  double poisson_ratio = 0;
  /// The model has every deformation mode up to this eigenvalue.
  double complete_to_eigenvalue = 0;
  std::vector<double> eigenvalues;  ///< #m, ascending
  std::vector<double> couplings;    ///< #m
  /// The sounding surface: #V vertices in metres, #T triangles, counter-clockwise from outside.
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  /// #T: for each triangle, the triangle of the given surface on which it lies.
  std::vector<uint32_t> given_triangle;
  /// The given surface: #G vertices in metres, #H triangles.
  std::vector<std::array<float, 3>> given_vertices;
  std::vector<std::array<uint32_t, 3>> given_triangles;
  /// #V by 3 by #m, row-major: shapes[(vertex * 3 + axis) * m + mode], 1/kg^(1/2).
  std::vector<float, LargeAllocator<float>> shapes;

  size_t mode_count() const { return eigenvalues.size(); }
};

}  // namespace carillon
