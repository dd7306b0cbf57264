// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <csignal>
#include <ctime>

namespace carillon::cli {

/// Blocks SIGINT and SIGTERM, so that a command can clean up before it ends. Construct it before
/// any thread starts.
class StopSignal {
 public:
  StopSignal() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// Waits for one of the signals. Returns its number as soon as it arrives, or 0 if none has
  /// arrived after `seconds`.
  int ArrivesWithin(double seconds) const {
    timespec timeout = {};
    timeout.tv_sec = static_cast<time_t>(seconds);
    timeout.tv_nsec = static_cast<long>((seconds - static_cast<double>(timeout.tv_sec)) * 1e9);
    return std::max(0, sigtimedwait(&signals_, nullptr, &timeout));
  }

  /// Lets the signals reach this thread again.
  void Release() const { pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr); }

 private:
  sigset_t signals_;
};

}  // namespace carillon::cli
