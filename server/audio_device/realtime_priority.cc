// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/realtime_priority.h"

#include <pthread.h>
#include <sched.h>

#include "proto/cpp/error_reason.h"

namespace carillon {

absl::Status MakeRealtime(std::thread& thread, Urgency urgency) {
  // The threads of sound servers usually run at 10 to 70, and kernel interrupts at 50.
  sched_param parameters{};
  parameters.sched_priority = static_cast<int>(urgency);
  // RESET_ON_FORK: a decomposition started by a real-time process must not inherit the priority.
  if (pthread_setschedparam(thread.native_handle(), SCHED_FIFO | SCHED_RESET_ON_FORK,
                            &parameters) == 0) {
    return absl::OkStatus();
  }
  return Refusal(absl::StatusCode::kPermissionDenied, "REALTIME_NOT_ALLOWED",
                 "the render thread runs without real-time priority and may drop out on a busy "
                 "machine; grant it with LimitRTPRIO= in systemd or rtprio in limits.conf");
}

}  // namespace carillon
