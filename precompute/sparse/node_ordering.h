// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// Pivot order of the unknowns that keeps factors sparse: element k is the unknown eliminated k-th.
/// Nested dissection of the graph of nodes, a third the size of that of the unknowns, whose three
/// components then follow one another.
std::vector<int> OrderUnknowns(const SystemMatrices& system);

/// Such an order of the nodes of a body whose walls are mostly one element thick, with the two
/// nodes of each place of the wall taken as one: found in less than half the time, and as sparse.
/// Empty where the body is another.
std::vector<int> OrderThinWall(const SystemMatrices::Sparse& K);

}  // namespace carillon::precompute
