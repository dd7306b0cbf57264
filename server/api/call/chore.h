// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <semaphore>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "server/api/call/thread_pool.h"

namespace carillon {

/// Work of the daemon itself that runs on a thread of a pool whenever it is due, and may wait there
/// for the disk or for a lock.
class Chore {
 public:
  /// `pool` must outlive the last call of Start, and must end before the chore is destroyed.
  Chore(ThreadPool& pool, std::function<void()> work) : pool_(pool), work_(std::move(work)) {}
  Chore(const Chore&) = delete;
  Chore& operator=(const Chore&) = delete;

  /// Gives the work to the pool, unless the work of the previous call has not ended yet. Never
  /// waits.
  void Start() {
    if (!idle_.try_acquire()) return;
    pool_.Run([this] {
      const absl::Cleanup end = [this] { idle_.release(); };  // also after an exception
      work_();
    });
  }

  /// Waits until the work has ended. Start does nothing from then on.
  void Stop() { idle_.acquire(); }

 private:
  ThreadPool& pool_;
  const std::function<void()> work_;
  std::binary_semaphore idle_{1};
};

}  // namespace carillon
