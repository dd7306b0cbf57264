// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "server/api/edge/access/access_table.h"
#include "server/base/clock.h"
#include "server/base/event.h"
#include "server/base/limited_events.h"
#include "server/base/mutex.h"

namespace carillon {

/// Logs what calls have done. Each event gets the fields `caller`, the name in the access file, and
/// `peer`, the process or address. Events that only administrators can cause are never left out;
/// each kind of the others is limited by itself. Safe from every thread.
class CallEvents {
 public:
  /// `clock` must outlive the object.
  CallEvents(const Clock& clock, EventSink sink) : clock_(clock), sink_(std::move(sink)) {}

  /// Logs an event that only administrators can cause.
  void Log(Event event, const Principal& caller) const;

  /// Logs an event that any client can cause.
  void LogLimited(Event event, const Principal& caller);

 private:
  const Clock& clock_;
  const EventSink sink_;
  Mutex mutex_;
  std::map<std::string, LimitedEvents> kinds_ ABSL_GUARDED_BY(mutex_);  ///< by the event's name
};

}  // namespace carillon
