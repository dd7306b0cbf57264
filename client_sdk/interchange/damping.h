// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "carillon/v1/material.pb.h"

namespace carillon::interchange {

/// A mode that decays as exp(-d t).
struct DampedMode {
  double natural_hz = 0;
  double decay_per_s = 0;  ///< d
};

/// Gives `material` a damping with which the modes decay at their rates within kSameDamping. The
/// material keeps its own damping if that is near enough. Otherwise it gets the best damping
/// proportional to stiffness and mass. If that is not near enough either, it gets a loss factor at
/// the frequency of each mode, or at the frequencies of 256 modes.
void FitDamping(const std::vector<DampedMode>& modes, v1::Material& material);

/// Returns the largest error of the decay rates that `material` gives to the modes. The error of a
/// mode is relative to the greater of its two rates. Differences that become audible only after a
/// thousand seconds do not count.
double DampingError(const std::vector<DampedMode>& modes, const v1::Material& material);

/// The relative error of a decay rate up to which two dampings count as the same.
inline constexpr double kSameDamping = 0.01;

}  // namespace carillon::interchange
