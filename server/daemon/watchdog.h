// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <semaphore>
#include <thread>

#include "server/live_output/live_output.h"

namespace carillon {

/// Reports to systemd that the daemon is alive, as long as the mixer renders, if the unit sets
/// WatchdogSec=. The watchdog also shows the state of the output in `systemctl status`.
class Watchdog {
 public:
  /// `output` must outlive the watchdog.
  explicit Watchdog(LiveOutput& output);

  /// Joins the thread. From then on only systemd's time limit for a stop applies.
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

 private:
  void Run();

  LiveOutput& output_;
  std::binary_semaphore stop_{0};
  std::thread thread_;
};

}  // namespace carillon
