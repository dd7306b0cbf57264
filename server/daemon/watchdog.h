// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

#include "server/live_output/live_output.h"

namespace carillon {

/// Reports to systemd that the daemon is alive, as long as the mixer renders, if the unit sets
/// WatchdogSec=. The watchdog also shows the state of the output in `systemctl status`.
class Watchdog {
 public:
  /// `output` must outlive the watchdog.
  explicit Watchdog(LiveOutput& output);

  /// The time from one report to the next: at most a third of systemd's limit, so that one delay
  /// does not end the daemon.
  std::chrono::milliseconds period() const { return period_; }

  void Report();

 private:
  LiveOutput& output_;
  const std::chrono::milliseconds period_;
  uint64_t last_frame_;
};

}  // namespace carillon
