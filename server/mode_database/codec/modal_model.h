// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/base/large_allocator.h"

namespace carillon {

/// A region of a body of several materials.
struct ModelRegion {
  std::string name;
  double relative_young = 1;    ///< Young's modulus, relative to that of the reference material
  double relative_density = 1;  ///< density, relative to that of the reference material
  double poisson_ratio = 0;
  std::vector<float> strain_energy_parts;   ///< #m, of each mode, from 0 to 1
  std::vector<float> kinetic_energy_parts;  ///< #m
};

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
  /// #m: d ln Lambda / d nu at `poisson_ratio`, or empty in models without them.
  std::vector<double> poisson_slopes;
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
  /// The regions of a body of several materials, whose reference has unit Young's modulus and
  /// density; empty if the body has one material.
  std::vector<ModelRegion> regions = {};
  std::vector<uint8_t> given_triangle_regions = {};  ///< #H: the region that each bounds, or empty
  double mass_kg = 0;  ///< for a reference of unit density; zero if there are no regions

  size_t mode_count() const { return eigenvalues.size(); }
};

}  // namespace carillon
