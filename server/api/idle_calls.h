// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <set>

#include "absl/base/thread_annotations.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/base/recursive_mutex.h"

namespace carillon {

/// Says since when a call waits for its client. Safe from every thread.
class ClientWait {
 public:
  /// `clock` must outlive this. The call waits from now on.
  explicit ClientWait(const Clock& clock) : clock_(clock), since_(clock.Monotonic()) {}

  /// The client has done something. False: the call was ended meanwhile.
  bool Resume();

  /// From now on the call waits for its client.
  void Begin();

  /// Whether the call waits for `limit` or longer; if so, it counts as ended.
  bool EndIfLonger(std::chrono::nanoseconds limit);

 private:
  const Clock& clock_;
  Mutex mutex_;
  bool waits_ ABSL_GUARDED_BY(mutex_) = true;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  std::chrono::nanoseconds since_ ABSL_GUARDED_BY(mutex_);
};

/// A call that is ended if its client says nothing for too long.
class IdleCall {
 public:
  virtual ~IdleCall() = default;

  /// Ends the call if it has waited for its client for `limit`. The call may be deleted before this
  /// returns.
  virtual void EndIfIdle(std::chrono::nanoseconds limit) = 0;
};

/// The calls whose idleness is bounded. Safe from every thread.
class IdleCalls {
 public:
  void Add(IdleCall& call);
  /// The destructor of a call calls it first.
  void Remove(IdleCall& call);

  void EndIdle(std::chrono::nanoseconds limit);

 private:
  /// Held while a call is ended, so that none is deleted meanwhile but by that thread itself.
  RecursiveMutex mutex_;
  std::set<IdleCall*> calls_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
