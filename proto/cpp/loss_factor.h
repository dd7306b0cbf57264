// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// The loss factor eta of a material at one natural frequency: of a mode there it adds eta omega/2
/// to the decay rate.
struct LossFactorPoint {
  double frequency_hz = 0;  ///< above zero
  double loss_factor = 0;   ///< above zero and below 2, where a mode would be overdamped
};

/// The loss factor at a frequency: between `points`, ascending, straight in the logarithms of both;
/// beyond the ends that of the end; zero where there are none.
double LossFactorAt(std::span<const LossFactorPoint> points, double frequency_hz);

/// Reads "ETA", the same at all frequencies, or "HZ:ETA,HZ:ETA,...".
/// Errors: InvalidArgument (INVALID_MATERIAL). What is out of range is left for ResolveMaterial.
absl::StatusOr<std::vector<LossFactorPoint>> ReadLossFactor(absl::string_view text);

}  // namespace carillon
