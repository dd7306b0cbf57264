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

/// Greatest number of open calls on one connection. gRPC makes further calls wait in the client,
/// but only after the client has confirmed this limit.
inline constexpr int kMaxCallsOfConnection = 256;

/// Greatest number of calls that may fail in a second on one connection, averaged over half a
/// second.
inline constexpr double kMaxFailedCallsPerSecond = 2000;

/// Returns the reason to close a connection with these counts, as a text for an operator, or an
/// empty string if the connection may stay. `before` was counted `seconds` before `now`.
std::string FindFlood(const ConnectionCalls& before, const ConnectionCalls& now, double seconds);

/// A thread that closes connections whose clients begin calls without end, because gRPC 1.51 bounds
/// neither calls that are cancelled at once nor calls that never send their message. The guard also
/// refuses further connections from the same process (Unix) or address (TCP) for
/// ConnectionGate::RefusalTimeOf().
class FloodGuard {
 public:
  /// `gate` and `log` must outlive the guard.
  FloodGuard(ConnectionGate& gate, LimitedLog& log);

  /// Joins the thread.
  ~FloodGuard();
  FloodGuard(const FloodGuard&) = delete;
  FloodGuard& operator=(const FloodGuard&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  struct Watched {
    std::string peer;
    ConnectionCalls calls;     ///< counts at the start of the span over which calls are counted
    Clock::time_point since;   ///< start of that span
    uint64_t begun_count = 0;  ///< calls begun by the last look at the connection
    bool busy = false;         ///< whether calls had begun between the last two looks
  };
  using WatchedById = std::map<int64_t, Watched>;

  void Run();
  /// Examines the connections that most likely flood, which are the newest and the busy ones, and
  /// some of the others in turn.
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
