// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>

#include "absl/base/thread_annotations.h"
#include "server/base/thread_role.h"

namespace carillon {

/// A Mutex that the thread that holds it may lock again.
class ABSL_LOCKABLE RecursiveMutex {
 public:
  void Lock() ABSL_EXCLUSIVE_LOCK_FUNCTION() ABSL_LOCKS_EXCLUDED(kRenderRole) { mutex_.lock(); }
  void Unlock() ABSL_UNLOCK_FUNCTION() { mutex_.unlock(); }

 private:
  std::recursive_mutex mutex_;
};

/// Locks a recursive mutex until the end of a scope.
class ABSL_SCOPED_LOCKABLE RecursiveMutexLock {
 public:
  explicit RecursiveMutexLock(RecursiveMutex* mutex) ABSL_EXCLUSIVE_LOCK_FUNCTION(mutex)
      ABSL_LOCKS_EXCLUDED(kRenderRole)
      : mutex_(mutex) {
    mutex_->Lock();
  }
  RecursiveMutexLock(const RecursiveMutexLock&) = delete;
  RecursiveMutexLock& operator=(const RecursiveMutexLock&) = delete;
  ~RecursiveMutexLock() ABSL_UNLOCK_FUNCTION() { mutex_->Unlock(); }

 private:
  RecursiveMutex* mutex_;
};

}  // namespace carillon
