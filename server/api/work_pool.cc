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
  {
    const absl::MutexLock lock(&mutex_);
    ending_ = true;
  }
  for (std::thread& thread : threads_) thread.join();
}

void WorkPool::Run(std::function<void()> task) {
  const absl::MutexLock lock(&mutex_);
  tasks_.push_back(std::move(task));
}

void WorkPool::Work(int niceness) {
  // On Linux this is the niceness of the one thread.
  if (niceness > 0) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  while (true) {
    std::function<void()> task;
    {
      const absl::MutexLock lock(&mutex_, absl::Condition(this, &WorkPool::HasWork));
      if (tasks_.empty()) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    task();
  }
}

}  // namespace carillon
