// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/api/edge/connection_calls.h"
#include "server/api/edge/connection_gate.h"
#include "server/api/edge/tcp_bytes.h"
#include "server/base/limited_log.h"

namespace carillon {

/// Greatest number of open calls on one connection. gRPC makes further calls wait in the client,
/// but only after the client has confirmed this limit.
inline constexpr int kMaxCallsOfConnection = 256;

/// Greatest number of calls that may fail in a second on one connection, averaged over half a
/// second.
inline constexpr double kMaxFailedCallsPerSecond = 2000;

/// Greatest number of open calls on all connections of one process (Unix) or address (TCP).
inline constexpr uint64_t kMaxCallsOfSource = 4096;

/// Greatest number of calls that may fail in a second on all connections of one process or address,
/// averaged over a second. Calls fail that are open when their connection ends.
inline constexpr double kMaxFailedCallsOfSource = 2500;

/// Greatest number of bytes that may come over a TCP connection without a new call or a whole
/// message. There may be more for open calls, for what the client receives, and for pings, see
/// MostIdleBytes.
inline constexpr uint64_t kMostIdleBytes = uint64_t{16} << 20U;

/// Returns the greatest number of idle bytes if `open_count` calls are open, and if since the last
/// call or message `acknowledged` bytes went to the client and `seconds` have passed.
uint64_t MostIdleBytes(uint64_t open_count, uint64_t acknowledged, double seconds);

/// Returns the reason to close a connection with these counts, as a text for an operator, or an
/// empty string if the connection may stay. `before` was counted `seconds` before `now`.
std::string FindFlood(const ConnectionCalls& before, const ConnectionCalls& now, double seconds);

/// Closes connections whose clients begin calls without end, because gRPC 1.51 bounds
/// neither calls that are cancelled at once nor calls that never send their message, and keeps the
/// headers of a call that never end. It also counts the calls of each process and address, so that
/// a client that makes a new connection for each flood is found. The guard also
/// refuses further connections from the same process (Unix) or address (TCP) for
/// ConnectionGate::RefusalTimeOf().
class FloodGuard {
 public:
  using Clock = std::chrono::steady_clock;

  /// `gate` and `log` must outlive the guard.
  FloodGuard(ConnectionGate& gate, LimitedLog& log) : gate_(gate), log_(log) {}
  FloodGuard(const FloodGuard&) = delete;
  FloodGuard& operator=(const FloodGuard&) = delete;

  /// Looks at some connections, and returns the time after which the next look is due. Only one
  /// thread may call it.
  Clock::duration Look();

 private:
  struct Watched {
    std::string peer;
    std::string source;        ///< SourceOfPeer
    ConnectionCalls newest{};  ///< counts at the last look
    ConnectionCalls calls;     ///< counts at the start of the span over which calls are counted
    Clock::time_point since;   ///< start of that span
    uint64_t progress = 0;     ///< ConnectionCalls::progress() when it changed last
    TcpBytes bytes{};          ///< counts when the progress changed last
    Clock::time_point progressed{};  ///< when it changed last
    bool refused = false;            ///< whether the calls no longer count for the source
    bool busy = false;               ///< whether calls had begun between the last two looks
  };
  using WatchedById = std::map<int64_t, Watched>;
  /// The calls on all connections of a process or address.
  struct Source {
    size_t connection_count = 0;
    uint64_t open_count = 0;
    uint64_t failed_count = 0;  ///< since the start of the span over which they are counted
    Clock::time_point since{};
  };

  /// Examines the connections that most likely flood, which are the newest and the busy ones, and
  /// some of the others in turn.
  void LookAtConnections(Clock::time_point now);
  void WatchNewConnections(Clock::time_point now);
  std::vector<int64_t> ChooseConnections();
  void LookAt(WatchedById::iterator at, Clock::time_point now);
  /// Adds the calls of a connection since the last look to those of its source. `now` is null if
  /// the connection has ended.
  void CountForSource(Watched& watched, const ConnectionCalls* now);
  /// Lets the calls of a connection that is closed no longer count for its source.
  void LeaveSource(Watched& watched);
  /// Returns the reason to refuse a source, or an empty string.
  std::string FindFloodOfSource(Source& source, Clock::time_point now);
  /// Returns the reason to close a connection whose client sends bytes that are neither calls nor
  /// whole messages, or an empty string.
  static std::string FindIdleBytes(Watched& watched, const ConnectionCalls& calls,
                                   const TcpBytes& bytes, Clock::time_point now);

  ConnectionGate& gate_;
  LimitedLog& log_;
  WatchedById watched_;
  std::map<std::string, Source> sources_;
  Clock::time_point next_sweep_{};
  int64_t next_in_turn_ = 0;
};

}  // namespace carillon
