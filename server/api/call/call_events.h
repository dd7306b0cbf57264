// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/api/edge/access/access_table.h"
#include "server/base/clock.h"
#include "server/base/event.h"
#include "server/base/limited_events.h"

namespace carillon {

/// Logs what calls have done. Each event gets the fields `caller`, the name in the access file, and
/// `peer`, the process or address. Events that only administrators can cause are never left out;
/// each kind of the others is limited by itself. Safe from every thread.
class CallEvents {
 public:
  /// `clock` must outlive the object.
  CallEvents(const Clock& clock, const EventSink& sink);

  /// Logs an event that only administrators can cause.
  void Log(Event event, const Principal& caller) const;

  void LogSubmitted(Event event, const Principal& caller);
  void LogCancelled(Event event, const Principal& caller);
  void LogUploaded(Event event, const Principal& caller);
  void LogImported(Event event, const Principal& caller);
  void LogUpdated(Event event, const Principal& caller);
  void LogScene(Event event, const Principal& caller);

 private:
  const EventSink sink_;
  LimitedEvents submitted_;
  LimitedEvents cancelled_;
  LimitedEvents uploaded_;
  LimitedEvents imported_;
  LimitedEvents updated_;
  LimitedEvents scenes_;
};

}  // namespace carillon
