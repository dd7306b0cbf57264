// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/synthesis/bank/lane_plan.h"
#include "server/synthesis/bank/shape_table.h"
#include "server/synthesis/bank/sounding_modes.h"

namespace carillon {

/// The multiplets of a bank: three or more modes of one frequency, whose basis is arbitrary.
///
/// A sound that is a linear function of the modal impulses g_i and of the time would have a level
/// that depends on the basis, because one frequency has room for two modes that do not interfere
/// (a sine and a cosine). Therefore a multiplet rings as one lane, with the modal impulse
///
///   g = (sum over i of g_i^2)^(1/2)
///
/// whose energy is that of all its modes in every basis. As at the point that is struck, where a
/// mode moves by phi_i g_i, all multiplets begin in the direction of the impulse. The sum over the
/// simultaneous impulses or forces of one call is taken before the root. Impulses at different
/// times interfere at random, as the modes themselves would.
///
/// Modal impulses have one column for each projected column, padded to whole vectors, and then one
/// column for each multiplet.
class Multiplets {
 public:
  Multiplets(const SoundingModes& sounding, const ShapeTable& shapes);

  /// The first column of the shape table onto which impulses are projected, and their number.
  uint32_t first_column() const noexcept { return first_column_; }
  size_t projected_count() const noexcept { return projected_count_; }
  /// Number of all columns of modal impulses.
  size_t column_count() const noexcept { return padded_count_ + firsts_.size() - 1; }

  /// Returns the column, counted from first_column() on, of the modal impulses that drive a lane.
  uint32_t ColumnOf(const PlannedLane& lane) const noexcept {
    return lane.multiplet == 0 ? lane.column - first_column_
                               : static_cast<uint32_t>(padded_count_) + lane.multiplet - 1;
  }

  /// Sets the columns of the multiplets from the projected columns.
  void Combine(float* modal_impulses) const noexcept;

 private:
  uint32_t first_column_ = 0;
  size_t projected_count_ = 0;
  size_t padded_count_ = 0;
  std::vector<size_t> firsts_{0};  // of each multiplet in columns_, and the end
  std::vector<uint32_t> columns_;
  std::vector<float> scales_;  // of the shape table, by columns_
};

}  // namespace carillon
