// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/work_clock.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>

namespace carillon::precompute {

WorkClock::Times WorkClock::Now() {
  const auto wall = std::chrono::steady_clock::now().time_since_epoch();
  double run_ns = 0, waited_ns = 0;
  std::ifstream("/proc/self/schedstat") >> run_ns >> waited_ns;
  return {.seconds = std::chrono::duration<double>(wall).count(), .waited_s = 1e-9 * waited_ns};
}

void WorkClock::Advance(const Times& now) {
  constexpr double kMemory_s = 10;
  const double passed_s = now.seconds - last_.seconds;
  const double worked_s = std::max(0.0, passed_s - (now.waited_s - last_.waited_s));
  last_ = now;
  worked_s_ += worked_s;
  const double kept = std::exp(-passed_s / kMemory_s);
  recent_s_ = kept * recent_s_ + passed_s + (1 - kept) * kTrust_s;
  recent_worked_s_ = kept * recent_worked_s_ + worked_s + (1 - kept) * kTrust_s;
}

}  // namespace carillon::precompute
