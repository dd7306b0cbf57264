// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// Nodes that the mesh of a resolved request will have, guessed from what is asked for and the size
/// of the mesh file; nobody has looked into it yet.
double GuessNodeCount(const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes);

/// Memory of a decomposition with so many nodes, bytes: 30 MB + 650 n^(4/3). The factor of a body's
/// stiffness fills in so; measured on bars of 3000 to 75000 nodes, right within a quarter there.
uint64_t MemoryOfNodes(double node_count);

/// What decompositions took, beside what they had been estimated to take. One thread at a time.
class MemoryExperience {
 public:
  /// `correction`: what Learn has come to in an earlier run of the daemon.
  explicit MemoryExperience(double correction = 1);

  /// `estimate_bytes` (before any correction) was the estimate for what took `seen_bytes`.
  void Learn(uint64_t estimate_bytes, uint64_t seen_bytes);

  /// The estimate after what was learnt.
  uint64_t Corrected(uint64_t estimate_bytes) const;

  /// 0.1 to 10: geometric mean of seen over estimated, of the last ten or so.
  double correction() const { return correction_; }

 private:
  double correction_;
};

}  // namespace carillon
