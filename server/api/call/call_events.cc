// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/call_events.h"

#include "server/api/edge/access/peer_name.h"

namespace carillon {
namespace {

Event& By(const Principal& caller, Event& event) {
  return event.With("caller", caller.name).With("peer", ProcessOfPeer(caller.connection));
}

}  // namespace

void CallEvents::Log(Event event, const Principal& caller) const { sink_(By(caller, event)); }

void CallEvents::LogLimited(Event event, const Principal& caller) {
  const std::string name(event.name());
  const MutexLock lock(&mutex_);
  kinds_.try_emplace(name, clock_, name, sink_).first->second.Log(By(caller, event));
}

}  // namespace carillon
