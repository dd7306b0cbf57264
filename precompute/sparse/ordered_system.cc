// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/ordered_system.h"

#include <utility>

namespace carillon::precompute {

absl::StatusOr<OrderedSystem> OrderedSystem::Make(const SystemMatrices& system) {
  absl::StatusOr<FrontalStructure> fronts = AnalyzeFronts(system.K);
  if (!fronts.ok()) return fronts.status();
  NodeMatrix matrix = MakeNodeMatrix(system.K, system.M, fronts->order);
  return OrderedSystem{.fronts = *std::move(fronts), .matrix = std::move(matrix)};
}

}  // namespace carillon::precompute
