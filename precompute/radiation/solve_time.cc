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

}  // namespace carillon::precompute
