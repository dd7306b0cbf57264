// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/thread_pool.h"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

namespace carillon {

ThreadPool::ThreadPool(int thread_count, int niceness) {
  for (int i = 0; i < thread_count; ++i) {
    threads_.emplace_back([this, niceness] { RunTasks(niceness); });
  }
}

ThreadPool::~ThreadPool() {
  ready_.release(static_cast<ptrdiff_t>(threads_.size()));
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::Run(std::function<void()> task) {
  {
    const MutexLock lock(&mutex_);
    tasks_.push_back(std::move(task));
  }
  ready_.release();
}

void ThreadPool::RunTasks(int niceness) {
  // Linux gives each thread a niceness of its own.
  if (niceness > 0) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  while (const std::function<void()> task = TakeTask()) task();
}

/// Returns the oldest task, or an empty function once the pool ends and no task is left.
std::function<void()> ThreadPool::TakeTask() {
  ready_.acquire();
  const MutexLock lock(&mutex_);
  if (tasks_.empty()) return nullptr;
  std::function<void()> task = std::move(tasks_.front());
  tasks_.pop_front();
  return task;
}

}  // namespace carillon
