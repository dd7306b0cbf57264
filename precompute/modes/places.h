// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The places of the functions that elements one order higher would add: the edges of a mesh, and
/// the faces of quadratic elements, each with a number. The places of an element are in the order
/// of AddedFunctions.
class Places {
 public:
  explicit Places(const TetMesh& mesh);

  size_t count() const { return corners_.size(); }
  /// The number of places of each element.
  size_t of_element() const { return of_element_; }
  size_t Of(size_t element, size_t i) const {
    return static_cast<size_t>(number_[element * of_element_ + i]);
  }
  /// An odd function on an edge changes its sign with the edge's direction. The added function of a
  /// linear element is even.
  double Sign(size_t element, size_t i) const {
    return of_element_ == 6 ? 1.0 : static_cast<double>(sign_[element * of_element_ + i]);
  }

  /// Returns for each place whether all of its corners are fixed.
  std::vector<bool> FixedWith(const TetMesh& mesh) const;
  /// Returns for each place the largest of the nodes' values at its corners.
  std::vector<double> LargestOf(const std::vector<double>& values) const;
  /// Returns for each of the mesh's nodes the sum of the places' values, each divided among the
  /// corners of its place.
  std::vector<double> AtNodes(const TetMesh& mesh, const std::vector<double>& values) const;

 private:
  size_t of_element_;
  std::vector<std::array<int32_t, 3>> corners_;  // ascending; for an edge, -1 comes last
  std::vector<int32_t> number_;
  std::vector<int8_t> sign_;
};

}  // namespace carillon::precompute
