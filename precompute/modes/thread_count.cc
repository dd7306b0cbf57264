// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/thread_count.h"

#include <cblas.h>

#include <algorithm>
#include <thread>

namespace carillon::precompute {

void SetThreadCount(int count) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  openblas_set_num_threads(count > 0 ? count : processors);
}

}  // namespace carillon::precompute
