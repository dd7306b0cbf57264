// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace carillon {

/// Tells blows from loads in what an engine reports of one pair of bodies, step by step.
///
/// Engines give the load of a resting contact as an impulse in every step, and it jitters; a blow
/// is an impulse in one step or a few. Of a step's force, what exceeds three times the usual is
/// blow, where the usual is the greater of the median and the mean over the last steps, those
/// without contact included: a body that comes from flight has no usual force and strikes with all
/// it has, one that rests with a jitter does not strike.
class LoadTracker {
 public:
  /// Takes the next step's impulse, zero or more, of a step of `step_s` seconds, above zero.
  /// Returns the part of it that is a blow, 0 to 1.
  double Next(double impulse_newton_seconds, double step_s);

  /// Nothing has happened for so long that a new tracker would do the same.
  bool idle() const;

 private:
  /// Steps that are remembered; what is usual follows a change after half of them.
  static constexpr size_t kStepCount = 8;

  double Usual() const;

  std::array<double, kStepCount> forces_newtons_{};
  size_t next_ = 0;
};

}  // namespace carillon
