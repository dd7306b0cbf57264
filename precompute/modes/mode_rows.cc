// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/mode_rows.h"

#include <algorithm>

#include "precompute/sparse/block_kernels.h"

namespace carillon::precompute {
namespace {

Eigen::Index FilledUp(Eigen::Index count) {
  return (count + kBlockWidth - 1) / kBlockWidth * kBlockWidth;
}

}  // namespace

ModeRows::ModeRows(const Modes& modes, Eigen::Index first, Eigen::Index count)
    : eigenvalues_(Eigen::VectorXd::Zero(FilledUp(count))),
      shapes_(static_cast<size_t>(modes.shapes.rows() * FilledUp(count))) {
  eigenvalues_.head(count) = modes.eigenvalues.segment(first, count);
  // The shapes are transposed in parts that fit into the cache.
  constexpr Eigen::Index kPart = 64;
  for (Eigen::Index begin = 0; begin < modes.shapes.rows(); begin += kPart) {
    const Eigen::Index end = std::min(begin + kPart, modes.shapes.rows());
    for (Eigen::Index m = 0; m < count; ++m) {
      for (Eigen::Index r = begin; r < end; ++r) {
        shapes_[static_cast<size_t>(r * eigenvalues_.size() + m)] = modes.shapes(r, first + m);
      }
    }
  }
}

}  // namespace carillon::precompute
