// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/memory_estimate.h"

#include <algorithm>
#include <cmath>

#include "proto/cpp/mesh_format.h"

namespace carillon {
namespace {

// Nodes of a quadratic mesh for each corner: the corner and its share of the mid-side nodes.
constexpr double kQuadraticNodesACorner = 7.5;
constexpr double kFewestCorners = 600;
constexpr double kCornersAVertex = 2;  // those inside, too

}  // namespace

double GuessNodeCount(const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes) {
  const MeshFormat* known = FindMeshFormat(resolved.mesh_format());
  const MeshFormat& format = known != nullptr ? *known : kMeshFormats.front();
  const double vertices = static_cast<double>(mesh_bytes) / format.bytes_per_vertex;
  double corners = std::max(kFewestCorners, vertices * (format.is_surface ? kCornersAVertex : 1));
  const uint32_t asked = resolved.settings().mesh().target_node_count();
  if (asked > 0 && format.is_surface) corners = asked;
  return resolved.settings().element() == v1::ELEMENT_LINEAR ? corners
                                                             : corners * kQuadraticNodesACorner;
}

uint64_t MemoryOfNodes(double node_count) {
  return static_cast<uint64_t>(30e6 + 650 * std::pow(node_count, 4.0 / 3));
}

MemoryExperience::MemoryExperience(double correction) : correction_(1) {
  if (std::isfinite(correction)) correction_ = std::clamp(correction, 0.1, 10.0);
}

void MemoryExperience::Learn(uint64_t estimate_bytes, uint64_t seen_bytes) {
  if (estimate_bytes == 0 || seen_bytes == 0) return;
  constexpr double kWeightOfTheNewest = 0.1;
  const double ratio = static_cast<double>(seen_bytes) / static_cast<double>(estimate_bytes);
  const double mean = (1 - kWeightOfTheNewest) * std::log(correction_) +
                      kWeightOfTheNewest * std::log(std::clamp(ratio, 0.1, 10.0));
  correction_ = std::exp(mean);
}

uint64_t MemoryExperience::Corrected(uint64_t estimate_bytes) const {
  return static_cast<uint64_t>(static_cast<double>(estimate_bytes) * correction_);
}

}  // namespace carillon
