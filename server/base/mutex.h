// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>

#include "absl/base/thread_annotations.h"
#include "server/base/thread_role.h"

namespace carillon {

/// std::mutex with the annotations that clang's thread-safety analysis checks. absl::Mutex is not
/// used, because ThreadSanitizer does not see locks in libraries that were compiled without it.
class ABSL_LOCKABLE Mutex {
 public:
  void Lock() ABSL_EXCLUSIVE_LOCK_FUNCTION() ABSL_LOCKS_EXCLUDED(kRenderRole) { mutex_.lock(); }
  void Unlock() ABSL_UNLOCK_FUNCTION() { mutex_.unlock(); }

 private:
  std::mutex mutex_;
};

/// Locks a mutex until the end of a scope.
class ABSL_SCOPED_LOCKABLE MutexLock {
 public:
  explicit MutexLock(Mutex* mutex) ABSL_EXCLUSIVE_LOCK_FUNCTION(mutex)
      ABSL_LOCKS_EXCLUDED(kRenderRole)
      : mutex_(mutex) {
    mutex_->Lock();
  }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;
  ~MutexLock() ABSL_UNLOCK_FUNCTION() { mutex_->Unlock(); }

 private:
  Mutex* mutex_;
};

}  // namespace carillon
