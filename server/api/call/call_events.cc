// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/call_events.h"

#include "server/api/edge/access/peer_name.h"

namespace carillon {
namespace {

Event& By(const Principal& caller, Event& event) {
  return event.With("caller", caller.name).With("peer", ProcessOfPeer(caller.connection));
}

}  // namespace

CallEvents::CallEvents(const Clock& clock, const EventSink& sink)
    : sink_(sink),
      submitted_(clock, "submitted_jobs", sink),
      cancelled_(clock, "cancelled_jobs", sink),
      uploaded_(clock, "stored_meshes", sink),
      imported_(clock, "imported_models", sink),
      updated_(clock, "updated_models", sink),
      scenes_(clock, "scenes", sink) {}

void CallEvents::Log(Event event, const Principal& caller) const { sink_(By(caller, event)); }

void CallEvents::LogSubmitted(Event event, const Principal& caller) {
  submitted_.Log(By(caller, event));
}

void CallEvents::LogCancelled(Event event, const Principal& caller) {
  cancelled_.Log(By(caller, event));
}

void CallEvents::LogUploaded(Event event, const Principal& caller) {
  uploaded_.Log(By(caller, event));
}

void CallEvents::LogImported(Event event, const Principal& caller) {
  imported_.Log(By(caller, event));
}

void CallEvents::LogUpdated(Event event, const Principal& caller) {
  updated_.Log(By(caller, event));
}

void CallEvents::LogScene(Event event, const Principal& caller) { scenes_.Log(By(caller, event)); }

}  // namespace carillon
