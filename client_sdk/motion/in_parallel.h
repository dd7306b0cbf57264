// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace carillon::motion {

/// Calls `work` with each number below `count`, on as many threads as the machine has cores. The
/// calls must not write to the same places.
template <typename Work>
void InParallel(size_t count, const Work& work) {
  std::atomic<size_t> next = 0;
  const auto take = [&] {
    for (size_t i = next++; i < count; i = next++) work(i);
  };
  const size_t threads = std::min<size_t>(count, std::max(1U, std::thread::hardware_concurrency()));
  std::vector<std::jthread> others;
  others.reserve(threads);
  for (size_t i = 1; i < threads; ++i) others.emplace_back(take);
  take();
}

}  // namespace carillon::motion
