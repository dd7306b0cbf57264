// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "server/api/edge/connection_calls.h"
#include "server/api/edge/connection_gate.h"
#include "server/api/edge/tcp_bytes.h"
#include "server/base/limited_log.h"

namespace carillon {

/// Greatest number of open calls on all connections of one process (Unix) or address (TCP).
inline constexpr uint64_t kMaxCallsOfSource = 4096;

/// Greatest number of open calls on one connection. While calls end, gRPC's count of open calls may
/// exceed gRPC's own limit of 256.
inline constexpr uint64_t kMaxCallsOfConnection = 512;

/// Greatest number of calls that may fail in a second on all connections of one process or address.
/// A cancelled call fails, and so does a call that is open when its connection ends.
inline constexpr uint64_t kMaxFailedCallsPerSecond = 2500;

/// Greatest number of bytes that may come over a TCP connection without a new call or a whole
/// message, in addition to those of AllowedBytes. gRPC 1.51 keeps five times as much if the bytes
/// are messages in frames of one byte each.
inline constexpr uint64_t kMostIdleBytes = uint64_t{36} << 20U;

/// The same for all connections of one address together.
inline constexpr uint64_t kMostIdleBytesOfSource = uint64_t{96} << 20U;

/// Returns the number of bytes without a call or a message that an honest client may send to
/// confirm `acknowledged` received bytes, and to ask for `seconds` whether the daemon lives.
uint64_t AllowedBytes(uint64_t acknowledged, double seconds);

/// Closes connections whose clients begin calls without end, because gRPC 1.51 bounds neither calls
/// that are cancelled at once nor calls that never send their message, and keeps headers that never
/// end and frames of messages that never end. The calls of each process (Unix) or address (TCP) are
/// counted together, so that new connections help a flood little. The process or address of a flood
/// of calls gets no new connections for ConnectionGate::RefusalTimeOf.
class FloodGuard {
 public:
  using Clock = std::chrono::steady_clock;

  /// Time between two looks, unless the calls of some process or address grow towards a limit.
  static constexpr std::chrono::milliseconds kPeriod{50};

  /// `gate` and `log` must outlive the guard.
  FloodGuard(ConnectionGate& gate, LimitedLog& log) : gate_(gate), log_(log) {}
  FloodGuard(const FloodGuard&) = delete;
  FloodGuard& operator=(const FloodGuard&) = delete;

  /// Looks at all connections, and returns the time after which the next look is due. Only one
  /// thread may call it.
  Clock::duration Look();

  /// Returns whether no look is due until a connection comes.
  bool rests() const { return watched_.empty() && sources_.empty() && gate_.open_count() == 0; }

 private:
  struct Watched {
    std::string peer;
    std::string source;              ///< SourceOfPeer
    ConnectionCalls calls{};         ///< counts at the last look
    uint64_t failed_before = 0;      ///< calls that had failed when the present second began
    TcpBytes bytes{};                ///< counts at the last call or message
    Clock::time_point progressed{};  ///< time of the last call or message
    uint64_t idle_bytes = 0;         ///< since then, beyond AllowedBytes
  };
  /// The connections of one process or address.
  struct Source {
    uint64_t connection_count = 0;
    uint64_t open_count = 0;
    uint64_t most_open_count = 0;  ///< on one connection
    uint64_t idle_bytes = 0;
    uint64_t failed_count = 0;  ///< since the present second began
  };

  void LookAtConnections(Clock::time_point now);
  void WatchNewConnections(Clock::time_point now);
  void BeginSecond(Clock::time_point now);
  /// Reads the counts of a connection, and adds them to those of its source. Returns false if the
  /// connection has ended.
  bool Read(int64_t id, Watched& watched, Clock::time_point now);
  /// Returns the reason to refuse a source, as a text for an operator, or an empty string.
  std::string FindFlood(const Source& source, Clock::time_point now) const;
  /// Refuses a source, and ends those of its connections that have many open or failed calls.
  void Refuse(const std::string& name, const std::string& flood);
  /// Ends a connection that has sent too many bytes that are neither calls nor whole messages.
  void EndIfIdleBytes(const Watched& watched, const Source& source);

  ConnectionGate& gate_;
  LimitedLog& log_;
  std::map<int64_t, Watched> watched_;
  std::map<std::string, Source> sources_;
  Clock::time_point second_begin_{};
};

}  // namespace carillon
