// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <semaphore>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/base/mutex.h"

namespace carillon {

/// Threads for what may take a while (the database, rendering offline), so that gRPC's own never
/// wait. Tasks start in the order in which they came.
class WorkPool {
 public:
  /// `niceness` 0 to 19: how far its threads stand back behind others.
  explicit WorkPool(int thread_count, int niceness = 0);

  /// Runs what has been given so far, then ends.
  ~WorkPool();
  WorkPool(const WorkPool&) = delete;
  WorkPool& operator=(const WorkPool&) = delete;

  void Run(std::function<void()> task);

 private:
  void Work(int niceness);
  std::function<void()> Take();

  Mutex mutex_;
  std::deque<std::function<void()>> tasks_ ABSL_GUARDED_BY(mutex_);
  /// Counts the tasks, and one for each thread once the pool ends.
  std::counting_semaphore<> ready_{0};
  std::vector<std::thread> threads_;
};

}  // namespace carillon
