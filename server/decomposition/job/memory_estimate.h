// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// Estimates the number of mesh nodes of a resolved request from its settings and the size of the
/// mesh file. The daemon never parses the file.
double GuessNodeCount(const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes);

/// Returns the predicted memory of a decomposition with n nodes, bytes: 30 MB + 650 n^(4/3), where
/// the second term is the fill-in of a solid body's factor. The constants were fitted to bars of
/// 3000 to 75000 nodes, with errors below 25 %.
uint64_t MemoryOfNodes(double node_count);

/// Corrects memory estimates by the memory that earlier decompositions took. Only one thread at a
/// time may use an object.
class MemoryExperience {
 public:
  /// `correction` is the result of an earlier run of the daemon.
  explicit MemoryExperience(double correction = 1);

  /// Notes that a decomposition with the uncorrected estimate `estimate_bytes` took `seen_bytes`.
  void Learn(uint64_t estimate_bytes, uint64_t seen_bytes);

  /// Returns the estimate times the correction.
  uint64_t Corrected(uint64_t estimate_bytes) const;

  /// Returns the geometric mean, over about the last ten decompositions, of the ratio of memory
  /// taken to memory estimated; 0.1 to 10.
  double correction() const { return correction_; }

 private:
  double correction_;
};

}  // namespace carillon
