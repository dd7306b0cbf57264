// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
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
  /// Takes an accepted socket for which there is no place, only to tell its client so.
  virtual void Refuse(int connection) = 0;
};

/// Returns the process (Unix) or the address (TCP, AddressOfPeer) from which the connection with
/// this name came. All processes that the system cannot name count as one process.
std::string SourceOfPeer(const std::string& peer);

/// Accepts connections in place of gRPC, whose own listener stops for ever when no descriptor is
/// left (CVE-2023-4785). A limit leaves descriptors for the daemon's other work. Of the connections
/// beyond the limit, and beyond the share of one process or address, kMostRefused at a time are
/// told the reason. Others are closed at once.
///
/// The gate keeps a duplicate of the descriptor of each connection, because gRPC, which owns the
/// other one, may close it at any moment. The system tells the gate when a connection has ended, so
/// that the gate's thread sleeps while nobody connects or leaves.
class ConnectionGate {
 public:
  using SourceFunction = std::string(const std::string& peer);

  /// The time for which the gate closes new connections from the process or address of a refused
  /// connection.
  static constexpr std::chrono::seconds kRefusal{30};
  /// The shorter time for connections over loopback. All processes that connect over loopback have
  /// the same address.
  static constexpr std::chrono::seconds kLoopbackRefusal{1};

  static constexpr size_t kMostRefused = 16;

  /// A process (Unix) or address (TCP) may have the share `client_share`, as ClientLimits has it,
  /// of `max_connection_count`. `log`, which may be null, takes a line about the first connection
  /// that is closed for a limit, and a further line only after kRefusal has passed. It also takes a
  /// line if no connection can be accepted. `log` must outlive the gate.
  explicit ConnectionGate(size_t max_connection_count, double client_share = 1,
                          LimitedLog* log = nullptr, SourceFunction& source_of = SourceOfPeer);

  ~ConnectionGate();
  ConnectionGate(const ConnectionGate&) = delete;
  ConnectionGate& operator=(const ConnectionGate&) = delete;

  /// Binds the address. If its port is 0, it is set to the chosen port. The connections of the
  /// address are handed to `taker` once the gate is open. Errors: FailedPrecondition
  /// (LISTEN_FAILED).
  absl::Status Listen(ListenAddress& address, std::unique_ptr<ConnectionTaker> taker);

  /// Begins to accept. The gate's thread calls `on_first` when a connection comes while no other is
  /// open.
  void Open(std::function<void()> on_first = [] {});

  /// Joins the thread, and closes and removes the listening sockets. Connections that were taken
  /// stay open.
  void Close();

  /// Returns whether the connection with this name (ServerContext::peer) is open. Any thread may
  /// call it.
  bool IsOpen(const std::string& peer) const;

  /// Closes new connections of this process (Unix) or address (TCP) at once until RefusalTimeOf has
  /// passed, and leaves the open ones alone. Returns false if the gate does so already. Any thread
  /// may call it.
  bool Refuse(const std::string& source);

  /// Returns why there is no place for the connection with this name, or an empty string if there
  /// is one. Any thread may call it.
  std::string WhyRefused(const std::string& peer) const;

  /// Ends the connection with this name. Returns false if the connection is not open or is ending
  /// already. Any thread may call it.
  bool End(const std::string& peer);

  /// Returns the bytes of the open TCP connection with this name, or nothing for a Unix socket. Any
  /// thread may call it.
  std::optional<TcpBytes> CountBytes(const std::string& peer) const;

  /// Returns the time for which Refuse keeps out a process or address.
  static std::chrono::seconds RefusalTimeOf(const std::string& source);

  /// Number of connections that are open and have a place. Any thread may call it.
  size_t open_count() const;

 private:
  struct Door {
    int socket;
    ConnectionTaker* taker;
  };
  struct Connection {
    int descriptor;         ///< the gate's own, a duplicate of gRPC's
    std::string refusal{};  ///< empty if the connection has a place
    bool ending = false;
  };
  enum class Entry { kPlace, kRefusal, kNone };

  absl::Status ListenUnix(const ListenAddress& address, ConnectionTaker& taker);
  absl::Status ListenTcp(ListenAddress& address, ConnectionTaker& taker);
  /// Lets the thread of the gate wait for the events of a descriptor.
  void Await(int descriptor, uint32_t events) const;
  void Run();
  void Accept(const Door& door);
  /// Decides about a connection, and stores it by its peer unless it is to be closed at once.
  Entry Admit(const std::string& peer, const std::string& source, int duplicate);
  /// Removes the connection with this duplicate, which has ended, and closes the duplicate.
  void Forget(int duplicate);
  void ForgetLocked(const std::string& peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Returns why a process or address gets no place, or an empty string if it gets one.
  std::string WhyNoPlace(const std::string& source) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void WaitForDescriptors(int error);
  /// Logs a line, unless a line about the same `subject` was logged within kRefusal.
  void WarnOnce(const std::string& subject, const std::string& line);

  const size_t max_connection_count_;
  const double client_share_;
  LimitedLog* const log_;
  SourceFunction& source_of_;
  std::vector<std::unique_ptr<ConnectionTaker>> takers_;
  std::vector<Door> doors_;
  std::vector<SocketFile> socket_files_;  ///< that the gate has bound
  std::function<void()> on_first_;
  uint64_t accepted_count_ = 0;
  mutable Mutex mutex_;
  std::map<std::string, Connection> connections_ ABSL_GUARDED_BY(mutex_);  ///< by peer
  /// The peer of each duplicate.
  std::map<int, std::string> peers_ ABSL_GUARDED_BY(mutex_);
  /// Number of the open connections of each process or address that have a place.
  std::map<std::string, size_t> counts_ ABSL_GUARDED_BY(mutex_);
  size_t refused_count_ ABSL_GUARDED_BY(mutex_) = 0;  ///< connections without a place
  /// For each refused process or address, the time until which its connections are closed at once.
  std::map<std::string, std::chrono::steady_clock::time_point> refused_ ABSL_GUARDED_BY(mutex_);
  /// For each process or address that reached a limit, and for the gate's own trouble, the time
  /// until which nothing is logged about it. Only the gate's thread uses it.
  std::map<std::string, std::chrono::steady_clock::time_point> told_;
  const int stop_;    ///< becomes readable when the gate is to end
  const int events_;  ///< epoll's descriptor, for stop_, the doors and the connections
  std::thread thread_;
};

/// Raises this process's limit of open descriptors as far as the system allows. Returns the number
/// of connections that may then be open at a time.
size_t RaiseConnectionLimit();

}  // namespace carillon
