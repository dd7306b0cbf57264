// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// The loss factor eta of a material at one natural frequency. It adds eta omega/2 to the decay
/// rate of a mode of that frequency.
struct LossFactorPoint {
  double frequency_hz = 0;  ///< above zero
  double loss_factor =
      0;  ///< below 2, where a mode would be overdamped; zero at all points or at none
};

/// Returns the loss factor at a frequency. Between `points` (ascending) it is interpolated linearly
/// in the logarithms of both figures, and beyond the ends it is constant. It is zero if there are
/// no points.
double LossFactorAt(std::span<const LossFactorPoint> points, double frequency_hz);

/// Reads "ETA", which applies to all frequencies, or "HZ:ETA,HZ:ETA,...". Errors: InvalidArgument
/// (INVALID_MATERIAL). ResolveMaterial checks the range of the figures.
absl::StatusOr<std::vector<LossFactorPoint>> ReadLossFactor(absl::string_view text);

}  // namespace carillon
