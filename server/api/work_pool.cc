// SPDX-License-Identifier: Apache-2.0
#include "server/api/work_pool.h"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

namespace carillon {

WorkPool::WorkPool(int thread_count, int niceness) {
  for (int i = 0; i < thread_count; ++i) {
    threads_.emplace_back([this, niceness] { Work(niceness); });
  }
}

WorkPool::~WorkPool() {
  ready_.release(static_cast<ptrdiff_t>(threads_.size()));
  for (std::thread& thread : threads_) thread.join();
}

void WorkPool::Run(std::function<void()> task) {
  {
    const MutexLock lock(&mutex_);
    tasks_.push_back(std::move(task));
  }
  ready_.release();
}

void WorkPool::Work(int niceness) {
  // On Linux this is the niceness of the one thread.
  if (niceness > 0) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  while (const std::function<void()> task = Take()) task();
}

/// The oldest task; empty once there is none and the pool ends.
std::function<void()> WorkPool::Take() {
  ready_.acquire();
  const MutexLock lock(&mutex_);
  if (tasks_.empty()) return nullptr;
  std::function<void()> task = std::move(tasks_.front());
  tasks_.pop_front();
  return task;
}

}  // namespace carillon
