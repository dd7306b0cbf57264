// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/ordered_system.h"

#include <utility>

#include "proto/cpp/status_macros.h"

namespace carillon::precompute {

absl::StatusOr<OrderedSystem> OrderedSystem::Make(const SystemMatrices& system) {
  ASSIGN_OR_RETURN(FrontalStructure fronts, AnalyzeFronts(system.K));
  NodeMatrix matrix = MakeNodeMatrix(system.K, system.M, fronts.order);
  return OrderedSystem{.fronts = std::move(fronts), .matrix = std::move(matrix)};
}

}  // namespace carillon::precompute
