// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace carillon {

/// Divides the impulses that an engine reports for one pair of bodies, step by step, into blows and
/// loads.
///
/// Engines report the load of a resting contact as an impulse in every step, and this impulse
/// jitters. A blow is an impulse in one step or a few steps. The part of a step's force that
/// exceeds three times the usual force is a blow. The usual force is the greater of the median and
/// the mean over the last steps, including steps without contact. Blows before a flight, which is
/// three steps and 30 ms without contact, do not count. Therefore a body that comes from flight has
/// no usual force and strikes with its whole impulse, whereas a body that rests with a jitter does
/// not strike.
class LoadTracker {
 public:
  /// Number of remembered steps. The usual force follows a change after half of them.
  static constexpr size_t kStepCount = 8;

  /// Adds the next step, with an impulse of zero or more and a duration above zero. Returns the
  /// part of the impulse that is a blow, 0 to 1.
  double Next(double impulse_newton_seconds, double step_s);

  /// Returns the usual force, newtons.
  double Usual() const;

  /// Returns whether a remembered step had a blow.
  bool has_blows() const;

  /// Counts the remembered steps for nothing, as those of a body that bore no load.
  void Forget();

  /// Counts the blows of the remembered steps for nothing, as after a flight.
  void ForgetBlows();

  /// Returns whether all remembered steps had a load and no blow.
  bool rests() const;

  /// Returns whether all remembered steps were without contact, so that a new tracker would behave
  /// alike.
  bool idle() const;

 private:
  std::array<double, kStepCount> forces_newtons_{};
  std::array<double, kStepCount> blows_newtons_{};  // the parts of these that were blows
  size_t empty_count_ = kStepCount;                 // steps since the last contact, at most these
  double empty_s_ = 0;                              // how long they took
  size_t next_ = 0;
};

}  // namespace carillon
