// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Counts the seconds in which the main thread did not have to wait for a processor. A worker
/// yields to other programs, so that on a busy machine a second of its work may take many seconds.
class WorkClock {
 public:
  struct Times {
    double seconds = 0;   ///< by the wall clock
    double waited_s = 0;  ///< for which the main thread was ready to run, and no processor was free
  };

  explicit WorkClock(const Times& begin = Now()) : last_(begin) {}

  /// Returns the state of the clocks. The kernel tells the waiting time in /proc/self/schedstat;
  /// without that file it is zero.
  static Times Now();

  void Advance(const Times& now);

  /// Seconds of work since the beginning.
  double seconds() const { return worked_s_; }

  /// Seconds that a second of work took in about the last ten seconds, at least 1.
  double Slowdown() const { return recent_s_ / recent_worked_s_; }

 private:
  /// The recent times begin with so much unhindered work, so that the first milliseconds do not
  /// decide.
  static constexpr double kTrust_s = 0.1;

  Times last_;
  double worked_s_ = 0;
  double recent_s_ = kTrust_s;         ///< fades with a time constant of ten seconds
  double recent_worked_s_ = kTrust_s;  ///< likewise
};

}  // namespace carillon::precompute
