// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/solve_time.h"

#include <sys/resource.h>

#include <initializer_list>

namespace carillon::precompute {

double CpuSeconds() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
  }
  return seconds;
}

void SolveTime::TakeSolution(double seconds, double pairs) {
  measured_s_ += seconds;
  measured_pairs_ += pairs;
  seconds_per_pair_ = measured_s_ / measured_pairs_;
}

}  // namespace carillon::precompute
