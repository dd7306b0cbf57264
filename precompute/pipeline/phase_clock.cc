// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/phase_clock.h"

#include <sys/resource.h>

#include <chrono>

namespace carillon::precompute {
namespace {

double CpuSeconds(int who) {
  rusage usage{};
  getrusage(who, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

std::string_view PhaseName(v1::Phase phase) {
  constexpr std::array<std::string_view, kPhaseCount + 1> kNames = {
      "", "read", "mesh", "assemble", "factor", "solve", "verify", "write", "radiate"};
  return kNames[static_cast<size_t>(phase)];
}

void PhaseClock::Enter(v1::Phase phase) {
  Stop();
  phase_ = phase;
}

void PhaseClock::Stop() {
  const Times now = Now();
  Times& times = times_[static_cast<size_t>(phase_)];
  times.seconds += now.seconds - last_.seconds;
  times.cpu_seconds += now.cpu_seconds - last_.cpu_seconds;
  last_ = now;
}

PhaseClock::Times PhaseClock::Now() {
  const auto wall = std::chrono::steady_clock::now().time_since_epoch();
  return {.seconds = std::chrono::duration<double>(wall).count(),
          .cpu_seconds = CpuSeconds(RUSAGE_SELF) + CpuSeconds(RUSAGE_CHILDREN)};
}

}  // namespace carillon::precompute
