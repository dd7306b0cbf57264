// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/api/edge/client_limits.h"
#include "server/api/edge/idle_calls.h"
#include "server/base/clock.h"

namespace carillon {

/// The place of a streaming call among those of its client, and the parts of the daemon that end
/// the call if the client is idle.
struct CallBounds {
  ClientPlace place;
  IdleCalls& idle_calls;
  const Clock& clock;
};

}  // namespace carillon
