// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/multiplets.h"

#include <cmath>

#include "server/synthesis/ringing/lane_arrays.h"

namespace carillon {

Multiplets::Multiplets(const SoundingModes& sounding, const ShapeTable& shapes) {
  if (sounding.modes.empty()) return;
  first_column_ = sounding.modes.front().column;
  projected_count_ = sounding.modes.back().column - first_column_ + size_t{1};
  padded_count_ = (projected_count_ + kMostLanes - 1) / kMostLanes * kMostLanes;
  // The modes of a multiplet follow each other.
  for (const SoundingMode& mode : sounding.modes) {
    if (mode.multiplet == 0) continue;
    while (firsts_.size() <= mode.multiplet) firsts_.push_back(columns_.size());
    columns_.push_back(mode.column - first_column_);
    scales_.push_back(shapes.scale(mode.column));
    firsts_.back() = columns_.size();
  }
}

void Multiplets::Combine(float* modal_impulses) const noexcept {
  for (size_t multiplet = 0; multiplet + 1 < firsts_.size(); ++multiplet) {
    double sum = 0;
    for (size_t i = firsts_[multiplet]; i < firsts_[multiplet + 1]; ++i) {
      const double g = double{scales_[i]} * modal_impulses[columns_[i]];
      sum += g * g;
    }
    modal_impulses[padded_count_ + multiplet] = static_cast<float>(std::sqrt(sum));
  }
}

}  // namespace carillon
