// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace carillon::precompute {

/// The layout of an element: its dimension, its nodes, and how many of them are corners.
struct InpKind {
  int dimension;
  size_t node_count;
  size_t corner_count;
};

/// Returns the kind of elements of a type such as C3D10, CPS6 or S4R, in capitals; none for a type
/// that is no tetrahedron, no face and no line.
std::optional<InpKind> FindInpKind(std::string_view type);

}  // namespace carillon::precompute
