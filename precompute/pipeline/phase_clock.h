// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <string_view>

#include "precompute/pipeline/decomposition_observer.h"

namespace carillon::precompute {

/// Returns the name that users see: "read", "mesh", ...
std::string_view PhaseName(v1::Phase phase);

inline constexpr size_t kPhaseCount = v1::PHASE_RADIATE;  ///< the phases from v1::PHASE_READ on

/// Adds up how long each phase took.
class PhaseClock {
 public:
  struct Times {
    double seconds = 0;      ///< by the wall clock
    double cpu_seconds = 0;  ///< processor time of this process and of its children that have ended
  };

  PhaseClock() : last_(Now()) {}

  /// Ends the phase under way and begins `phase`.
  void Enter(v1::Phase phase);
  /// Ends the phase under way.
  void Stop();
  /// Returns the state of the clocks. The difference of two states is a time.
  static Times Now();
  const Times& Of(v1::Phase phase) const { return times_[static_cast<size_t>(phase)]; }

 private:
  std::array<Times, kPhaseCount + 1> times_;  // the entry of PHASE_UNSPECIFIED stays zero
  v1::Phase phase_ = v1::PHASE_READ;
  Times last_;
};

}  // namespace carillon::precompute
