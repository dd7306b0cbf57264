// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/api/edge/listen_address.h"
#include "server/api/edge/socket_file.h"
#include "server/api/edge/tcp_bytes.h"
#include "server/base/limited_log.h"
#include "server/base/mutex.h"

namespace carillon {

/// Takes accepted connections, and closes each connection that has ended.
class ConnectionTaker {
 public:
  virtual ~ConnectionTaker() = default;
  /// Takes the accepted socket `connection`. `source` is the process or address from which it came,
  /// as SourceOfPeer names it.
  virtual void Take(int connection, const std::string& source) = 0;
};

/// Returns the process (Unix) or the address (TCP, AddressOfPeer) from which the connection with
/// this name came. All processes that the system cannot name count as one process.
std::string SourceOfPeer(const std::string& peer);

/// Accepts connections in place of gRPC, whose own listener stops for ever when no descriptor is
/// left (CVE-2023-4785). A limit leaves descriptors for the daemon's other work. Connections beyond
/// the limit, and beyond the share of one process or address, are closed at once.
class ConnectionGate {
 public:
  using SourceFunction = std::string(const std::string& peer);

  /// The time for which the gate closes new connections from the process or address of a refused
  /// connection.
  static constexpr std::chrono::seconds kRefusal{30};
  /// The shorter time for connections over loopback. All processes that connect over loopback have
  /// the same address.
  static constexpr std::chrono::seconds kLoopbackRefusal{1};

  /// The last sixteenth of the places is for processes and addresses with fewer connections than
  /// this number, so that a new process or address finds a place. The last sixty-fourth is for Unix
  /// sockets, because many addresses may have few connections each.
  static constexpr size_t kFewConnections = 8;

  /// A process (Unix) or address (TCP) may have the share `client_share`, as ClientLimits has it,
  /// of `max_connection_count`. `log`, which may be null, takes a line about the first connection
  /// that is closed for a limit, and a further line only after kRefusal has passed. It also takes a
  /// line if no connection can be accepted, and if somebody removes or replaces a Unix socket.
  /// `log` must outlive the gate.
  explicit ConnectionGate(size_t max_connection_count, double client_share = 1,
                          LimitedLog* log = nullptr, SourceFunction& source_of = SourceOfPeer);

  ~ConnectionGate();
  ConnectionGate(const ConnectionGate&) = delete;
  ConnectionGate& operator=(const ConnectionGate&) = delete;

  /// Binds the address. If its port is 0, it is set to the chosen port. The connections of the
  /// address are handed to `taker` once the gate is open. Errors: FailedPrecondition
  /// (LISTEN_FAILED, ADDRESS_IN_USE).
  absl::Status Listen(ListenAddress& address, std::unique_ptr<ConnectionTaker> taker);

  /// Begins to accept.
  void Open();

  /// Joins the thread, and closes and removes the listening sockets. Connections that were taken
  /// stay open.
  void Close();

  /// Returns whether the connection with this name (ServerContext::peer) is open. Any thread may
  /// call it.
  bool IsOpen(const std::string& peer) const;

  /// Ends the connection with this name. Until kRefusal (or kLoopbackRefusal) has passed, other
  /// connections of the same process (Unix) or address (TCP) are closed at once. Returns false if
  /// the connection is not open or is ending already. Any thread may call it.
  bool Refuse(const std::string& peer);

  /// Closes new connections of the process or address of this peer at once, as Refuse does, and
  /// leaves the open ones alone. Returns false if it does so already. Any thread may call it.
  bool RefuseSource(const std::string& peer);

  /// Ends the connection with this name, and leaves others alone. Returns false if the connection
  /// is not open or is ending already. Any thread may call it.
  bool End(const std::string& peer);

  /// Returns the bytes of the open TCP connection with this name, or nothing for a Unix socket. Any
  /// thread may call it.
  std::optional<TcpBytes> CountBytes(const std::string& peer) const;

  /// Returns the time for which Refuse keeps out the process or address of this connection.
  std::chrono::seconds RefusalTimeOf(const std::string& peer) const;

  /// Number of connections that are open. Any thread may call it.
  size_t open_count() const;

 private:
  struct Door {
    int socket;
    ConnectionTaker* taker;
  };
  /// A Unix socket that the gate has bound.
  struct WatchedFile {
    SocketFile file;
    bool was_in_place = true;  ///< at the last look; only the gate's thread uses it
  };
  /// An open connection. Once the taker has closed it, the descriptor has no inode or the inode of
  /// another file, by which the gate sees that the connection is closed.
  struct Connection {
    int descriptor;
    ino_t inode;
    bool refused = false;
    bool is_open() const;
  };

  absl::Status ListenUnix(const ListenAddress& address, ConnectionTaker& taker);
  absl::Status ListenTcp(ListenAddress& address, ConnectionTaker& taker);
  void Run();
  void Accept(const Door& door);
  /// Returns whether another connection may be open. If so, stores this connection by its peer.
  bool Admit(const std::string& peer, const Connection& connection);
  /// Removes closed connections from the table, and returns true. If the last removal was very
  /// recent, does nothing and returns false.
  bool ForgetClosed() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Returns why a process or address gets no place, or an empty string if it gets one.
  std::string WhyNoPlace(const std::string& source) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Tell(const std::string& source, const std::string& reason);
  bool EndLocked(const std::string& peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Returns false if the source of `peer` is refused already.
  bool RefuseSourceLocked(const std::string& peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Logs a line, unless a line about the same `subject` was logged within kRefusal.
  void WarnOnce(const std::string& subject, const std::string& line);
  /// Logs at most once a second which socket files somebody has removed or replaced meanwhile.
  void LookAtSocketFiles();

  const size_t max_connection_count_;
  const double client_share_;
  LimitedLog* const log_;
  SourceFunction& source_of_;
  std::vector<std::unique_ptr<ConnectionTaker>> takers_;
  std::vector<Door> doors_;
  std::vector<WatchedFile> socket_files_;
  uint64_t accepted_count_ = 0;
  mutable Mutex mutex_;
  /// Connections by peer. Some of them may have been closed.
  std::map<std::string, Connection> connections_ ABSL_GUARDED_BY(mutex_);
  /// When connections_ has this size, the closed ones are removed from it.
  size_t most_remembered_ ABSL_GUARDED_BY(mutex_) = 64;
  /// Number of these connections of each process or address.
  std::map<std::string, size_t> counts_ ABSL_GUARDED_BY(mutex_);
  std::chrono::steady_clock::time_point next_forgetting_ ABSL_GUARDED_BY(mutex_);
  /// For each refused process or address, the time until which its connections are closed at once.
  std::map<std::string, std::chrono::steady_clock::time_point> refused_ ABSL_GUARDED_BY(mutex_);
  /// The time of the next look at the socket files. Only the gate's thread uses it.
  std::chrono::steady_clock::time_point next_look_;
  /// For each process or address that reached a limit, and for the gate's own trouble, the time
  /// until which nothing is logged about it. Only the gate's thread uses it.
  std::map<std::string, std::chrono::steady_clock::time_point> told_;
  int stop_;  ///< becomes readable when the gate is to end
  std::thread thread_;
};

/// Raises this process's limit of open descriptors as far as the system allows. Returns the number
/// of connections that may then be open at a time.
size_t RaiseConnectionLimit();

}  // namespace carillon
