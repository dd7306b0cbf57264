// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "carillon/v1/material.pb.h"

namespace carillon::interchange {

/// How one mode decays: as exp(-d t).
struct DampedMode {
  double natural_hz = 0;
  double decay_per_s = 0;  ///< d
};

/// Gives `material` the damping that makes the modes decay as they do: its own where that does so
/// within a hundredth, else the nearest in proportion to stiffness and mass, else a loss factor
/// at each of the modes, or at 256 of them.
void FitDamping(const std::vector<DampedMode>& modes, v1::Material& material);

/// How far the decay rates that `material` gives are off, at most, as a share of the greater rate.
/// Differences that take over a thousand seconds to be heard do not count.
double DampingError(const std::vector<DampedMode>& modes, const v1::Material& material);

/// What differs no more than this is the same damping: a hundredth.
inline constexpr double kSameDamping = 0.01;

}  // namespace carillon::interchange
