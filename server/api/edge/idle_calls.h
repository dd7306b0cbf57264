// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <set>

#include "absl/base/thread_annotations.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/base/recursive_mutex.h"

namespace carillon {

/// Records since when a call has waited for its client. Safe from every thread.
class ClientWait {
 public:
  /// The call waits from its construction on. `clock` must outlive this.
  explicit ClientWait(const Clock& clock) : clock_(clock), since_(clock.Monotonic()) {}

  /// Notes that the client has acted. Returns false if the call was ended meanwhile.
  bool Resume();

  /// Notes that the call waits for its client from this moment on.
  void Begin();

  /// Returns whether the call has waited for `limit` or longer. If so, the call counts as ended.
  bool EndIfLonger(std::chrono::nanoseconds limit);

  /// Returns whether the call waits and all its waiting so far adds up to `limit` or longer. If so,
  /// the call counts as ended.
  bool EndIfAllLonger(std::chrono::nanoseconds limit);

 private:
  const Clock& clock_;
  Mutex mutex_;
  bool waits_ ABSL_GUARDED_BY(mutex_) = true;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  std::chrono::nanoseconds since_ ABSL_GUARDED_BY(mutex_);
  std::chrono::nanoseconds waited_ ABSL_GUARDED_BY(mutex_){0};  // before `since_`
};

/// A call that is ended if its client is silent for too long.
class IdleCall {
 public:
  virtual ~IdleCall() = default;

  /// Ends the call if it has waited for its client for `limit`. The call may be deleted before this
  /// returns.
  virtual void EndIfIdle(std::chrono::nanoseconds limit) = 0;
};

/// The calls whose waiting time is limited. Safe from every thread.
class IdleCalls {
 public:
  void Add(IdleCall& call);
  /// Must be the first step of a call's destructor.
  void Remove(IdleCall& call);

  void EndIdle(std::chrono::nanoseconds limit);

 private:
  /// Held while a call is ended, so that only the thread that ends it may delete calls meanwhile.
  RecursiveMutex mutex_;
  std::set<IdleCall*> calls_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
