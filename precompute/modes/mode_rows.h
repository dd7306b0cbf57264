// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/eigen/eigensolver.h"
#include "precompute/modes/patch_kernels.h"

namespace carillon::precompute {

/// Some modes by rows, as the kernels take them: filled up to a multiple of kBlockWidth with modes
/// that do not move.
class ModeRows {
 public:
  /// Number of modes that are taken at a time, which bounds the memory for their rows.
  static constexpr Eigen::Index kAtATime = 64;

  ModeRows(const Modes& modes, Eigen::Index first, Eigen::Index count);

  ShapeRows rows() const { return {shapes_.data(), eigenvalues_.data(), eigenvalues_.size()}; }

 private:
  Eigen::VectorXd eigenvalues_;
  std::vector<double> shapes_;
};

}  // namespace carillon::precompute
