// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <semaphore>
#include <thread>

#include "server/live_output/live_output.h"

namespace carillon {

/// Tells systemd, if it asks for that (WatchdogSec=), that the daemon works: as long as the mixer
/// renders. It also shows the state of the output in `systemctl status`.
class Watchdog {
 public:
  /// `output` must outlive the watchdog.
  explicit Watchdog(LiveOutput& output);

  /// Joins the thread. A stop has a time limit of its own.
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
