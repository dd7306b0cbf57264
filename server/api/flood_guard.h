// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "server/api/connection_calls.h"
#include "server/api/connection_gate.h"
#include "server/api/limited_log.h"

namespace carillon {

/// Calls that may be open on one connection. gRPC makes further calls wait in the client, but only
/// once the client has confirmed the limit.
inline constexpr int kMaxCallsOfConnection = 256;

/// Calls a second that may fail on one connection, on the average of half a second.
inline constexpr double kMaxFailedCallsPerSecond = 2000;

/// Returns the reason to close a connection with these counts, in words for an operator; empty if
/// the connection may stay. `before` was counted `seconds` earlier.
std::string FindFlood(const ConnectionCalls& before, const ConnectionCalls& now, double seconds);

/// A thread that closes connections whose clients begin calls without end: gRPC 1.51 bounds neither
/// calls that are cancelled at once nor calls that never send their message. The guard also refuses
/// further connections from the same process or address for ConnectionGate::kRefusal.
class FloodGuard {
 public:
  /// Both must outlive the guard.
  FloodGuard(ConnectionGate& gate, LimitedLog& log);

  /// Joins the thread.
  ~FloodGuard();
  FloodGuard(const FloodGuard&) = delete;
  FloodGuard& operator=(const FloodGuard&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  struct Watched {
    std::string peer;
    ConnectionCalls calls;     ///< when the span over which calls are counted began
    Clock::time_point since;   ///< that time
    uint64_t begun_count = 0;  ///< when the connection was last looked at
    bool busy = false;         ///< it had begun calls since the time before
  };
  using WatchedById = std::map<int64_t, Watched>;

  void Run();
  /// Looks at the connections that most likely flood, the newest and the busy ones, and at some of
  /// the others in turn.
  void Look(Clock::time_point now);
  void WatchNewConnections(Clock::time_point now);
  std::vector<int64_t> ChooseConnections();
  void LookAt(WatchedById::iterator at, Clock::time_point now);

  ConnectionGate& gate_;
  LimitedLog& log_;
  WatchedById watched_;
  int64_t next_in_turn_ = 0;
  std::binary_semaphore stop_{0};
  std::thread thread_;
};

}  // namespace carillon
