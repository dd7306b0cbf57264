// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "carillon/v1/decomposition.pb.h"
#include "server/base/recursive_mutex.h"

namespace carillon {

/// Calls a function with each change of a job, in order, one call at a time, and not after Close.
class Watcher {
 public:
  explicit Watcher(std::function<void(const v1::Job&)> on_change)
      : on_change_(std::move(on_change)) {}

  /// Calls the function with `job`, unless the function has had a newer version. Versions count
  /// from 1.
  void Tell(const v1::Job& job, uint64_t version) {
    const RecursiveMutexLock lock(&mutex_);
    if (closed_ || version <= told_) return;
    told_ = version;
    on_change_(job);
  }

  /// Waits until no call is running, and prevents further calls.
  void Close() {
    const RecursiveMutexLock lock(&mutex_);
    closed_ = true;
  }

 private:
  // Recursive, because a watch may be ended within its own call.
  RecursiveMutex mutex_;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  uint64_t told_ ABSL_GUARDED_BY(mutex_) = 0;
  const std::function<void(const v1::Job&)> on_change_;
};

/// A change of a job, kept until no lock is held and its watchers can be called.
struct Notice {
  std::vector<std::shared_ptr<Watcher>> watchers;
  v1::Job job;
  uint64_t version = 0;

  void Tell() const {
    for (const auto& watcher : watchers) watcher->Tell(job, version);
  }
};

inline void TellAll(const std::vector<Notice>& notices) {
  for (const Notice& notice : notices) notice.Tell();
}

}  // namespace carillon
