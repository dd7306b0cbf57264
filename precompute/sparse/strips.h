// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>

#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Calls visit(first, count) for strips of the columns 0 ... n - 1 of a lower triangle, distributed
/// to the threads. If a matrix product is computed for each strip, only a small part of the upper
/// triangle is computed needlessly.
template <typename Visit>
void ForStrips(Workers& workers, int n, const Visit& visit) {
  constexpr int kStrip = 192;
  if (n <= 0) return;
  workers.ForEach((n + kStrip - 1) / kStrip, [&](int64_t strip) {
    const int first = static_cast<int>(strip) * kStrip;
    visit(first, std::min(kStrip, n - first));
  });
}

}  // namespace carillon::precompute
