// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>

namespace carillon {

/// Takes a line for the log.
using StopLog = std::function<void(const std::string&)>;

/// Blocks the signals that the daemon acts on, in this thread and in those that it starts, so that
/// only StartGuard and WaitForStop see them. Ignores the signals that must not end the daemon.
void BlockSignals();

/// Ends the process on a signal to stop (SIGINT, SIGTERM, SIGQUIT) while the daemon starts,
/// whatever the start waits for, and if its stop takes longer than 4 s, for instance because a call
/// computes. Nothing that was acknowledged is lost: the database is written as for a loss of power.
/// The only thread is made here, so that a stop needs neither a new thread nor memory.
class StopGuard {
 public:
  explicit StopGuard(StopLog log);

  /// Ends the guard.
  ~StopGuard();
  StopGuard(const StopGuard&) = delete;
  StopGuard& operator=(const StopGuard&) = delete;

  /// The start is complete. From then on WaitForStop takes the signals.
  void CompleteStart() const;

  /// The stop begins, which from then on has 4 s.
  void BeginStop() const;

 private:
  void Run() const;
  [[noreturn]] void EndNow(const std::string& line) const;

  const StopLog log_;
  const int signals_;   ///< readable once a signal to stop has come
  const int complete_;  ///< readable once the start is complete
  const int stopping_;  ///< readable once the stop has begun
  const int ended_;     ///< readable once the guard is to end
  std::thread thread_;
};

/// Work that is done again and again while WaitForStop waits.
struct RepeatedWork {
  std::chrono::microseconds period;
  std::function<void()> work;
};

/// Returns on SIGINT, SIGTERM and SIGQUIT. SIGHUP calls `reload`, but at most once a second:
/// signals that come sooner cause one call together.
void WaitForStop(const std::function<void()>& reload, const StopLog& log,
                 const RepeatedWork& repeated);

}  // namespace carillon
