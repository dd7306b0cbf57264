// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <thread>

namespace carillon {

/// Takes a line for the log.
using StopLog = std::function<void(const std::string&)>;

/// Blocks the signals that the daemon acts on, in this thread and in those that it starts, so that
/// only StartGuard and WaitForStop see them. Ignores the signals that must not end the daemon.
void BlockSignals();

/// Ends the process on SIGINT and SIGTERM while the daemon starts, whatever the start waits for.
/// Nothing that was acknowledged is lost: the database is written as for a loss of power.
class StartGuard {
 public:
  explicit StartGuard(StopLog log);
  ~StartGuard();
  StartGuard(const StartGuard&) = delete;
  StartGuard& operator=(const StartGuard&) = delete;

  /// Ends the guard. From then on WaitForStop takes the signals.
  void Complete();

 private:
  void Run() const;

  const StopLog log_;
  const int signals_;   ///< readable once a signal to stop has come
  const int complete_;  ///< readable once the start is complete
  std::thread thread_;
};

/// Returns on SIGINT and SIGTERM. SIGHUP calls `reload`, but at most once a second: signals that
/// come sooner cause one call together.
void WaitForStop(const std::function<void()>& reload, const StopLog& log);

/// Ends the process if it has not stopped within 4.5 s, for instance because a call computes.
/// Nothing that was acknowledged is lost, as for StartGuard.
void LimitStop(StopLog log);

}  // namespace carillon
