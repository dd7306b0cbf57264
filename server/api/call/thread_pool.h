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

/// Threads for calls that block (for the database or offline rendering), so that gRPC's own threads
/// never wait. Tasks may add further tasks. Tasks start in the order in which they were added.
class ThreadPool {
 public:
  /// `niceness`, 0 to 19, lowers the scheduling priority of the threads.
  explicit ThreadPool(int thread_count, int niceness = 0);

  /// Runs all tasks, then joins the threads.
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  void Run(std::function<void()> task);

 private:
  void RunTasks(int niceness);
  std::function<void()> TakeTask();

  Mutex mutex_;
  std::deque<std::function<void()>> tasks_ ABSL_GUARDED_BY(mutex_);
  /// Counts the waiting tasks; the destructor adds one for each thread.
  std::counting_semaphore<> ready_{0};
  std::vector<std::thread> threads_;
};

}  // namespace carillon
