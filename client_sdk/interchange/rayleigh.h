// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace carillon::interchange {

/// Damping in proportion to stiffness and mass: a mode of natural frequency omega decays as
/// exp(-d t), d = (alpha1 omega^2 + alpha2)/2.
struct Rayleigh {
  double alpha1_s = 0;
  double alpha2_per_s = 0;
};

/// One mode as measured.
struct DampedMode {
  double omega2 = 0;       ///< omega^2, 1/s^2
  double decay_per_s = 0;  ///< d
};

/// The nearest to the decay rates of `modes` by relative deviation, neither figure negative.
Rayleigh FitRayleigh(const std::vector<DampedMode>& modes);

/// The largest difference between the decay rate of a mode and what `damping` gives it, as a share
/// of the greater.
double Deviation(const Rayleigh& damping, const std::vector<DampedMode>& modes);

}  // namespace carillon::interchange
