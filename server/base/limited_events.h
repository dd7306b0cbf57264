// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "server/base/clock.h"
#include "server/base/event.h"
#include "server/base/limited_log.h"
#include "server/base/mutex.h"

namespace carillon {

/// A LimitedLog of events: untrusted clients cannot flood the log with them. It takes twenty events
/// at once, then one a second. Further events are dropped, and their count and subject are logged
/// as the event `events_left_out` before the next event. Safe from every thread.
class LimitedEvents {
 public:
  /// `subject`, in snake_case, tells what the events are about. `clock` must outlive the object.
  LimitedEvents(const Clock& clock, std::string subject, EventSink sink)
      : clock_(clock), subject_(std::move(subject)), sink_(std::move(sink)) {}

  /// Logs the number of events that were dropped since the last one.
  ~LimitedEvents();
  LimitedEvents(const LimitedEvents&) = delete;
  LimitedEvents& operator=(const LimitedEvents&) = delete;

  void Log(const Event& event);

 private:
  void SayWhatWasLeftOut() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock& clock_;
  const std::string subject_;
  const EventSink sink_;
  Mutex mutex_;
  Allowance events_ ABSL_GUARDED_BY(mutex_){LimitedLog::kMostAtOnce};
  uint64_t left_out_count_ ABSL_GUARDED_BY(mutex_) = 0;
  LogLevel left_out_level_ ABSL_GUARDED_BY(mutex_) = LogLevel::kDebug;
};

}  // namespace carillon
