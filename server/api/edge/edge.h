// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "server/api/edge/access/certificate_end.h"
#include "server/api/edge/access/tls_credentials.h"
#include "server/api/edge/access/tls_files.h"
#include "server/api/edge/connection_gate.h"
#include "server/api/edge/flood_guard.h"
#include "server/api/edge/grpc_servers.h"
#include "server/api/edge/listen_address.h"
#include "server/base/limited_log.h"

namespace carillon {

/// What the edge listens at, and what protects it.
struct EdgeSettings {
  std::vector<std::string> addresses{};  ///< as ParseListenAddress takes them
  TlsPaths tls{};
  bool has_access_file = false;  ///< whether a file says who may do what over TCP
  double client_share = 1;       ///< ClientLimits's
};

/// The daemon's door to its clients: listens, limits connections and floods, and lets gRPC serve
/// the connections. Two threads work for it. One accepts connections, and the other looks for
/// floods and begins what is due each second. While nobody is connected, the first sleeps, and the
/// second wakes once a second.
class Edge {
 public:
  /// Checks the settings by the rules of Serve, without opening a socket or changing anything.
  /// Errors: those of Serve that do not depend on what other processes do.
  static absl::Status Check(const EdgeSettings& settings);

  /// `certificate_end` learns when the first certificate expires. It and `log` must outlive this.
  Edge(EdgeSettings settings, CertificateEnd& certificate_end, LimitedLog& log);

  /// Cancels all calls, and waits until they have ended.
  ~Edge();
  Edge(const Edge&) = delete;
  Edge& operator=(const Edge&) = delete;

  /// Binds the addresses, and prepares to serve these services and health. `refusing` answers the
  /// calls of connections without a place, of which WhyRefused tells the reason. The services must
  /// outlive this. Errors: InvalidArgument (INVALID_CONFIGURATION), FailedPrecondition
  /// (TLS_REQUIRED, ACCESS_FILE_REQUIRED, TLS_UNUSABLE, LISTEN_FAILED).
  absl::Status Serve(absl::Span<grpc::Service* const> services,
                     grpc::CallbackGenericService& refusing);

  /// Begins to accept connections, and to call `each_second` on a thread of the edge.
  void Open(std::function<void()> each_second);

  /// Accepts no further connections, and no longer calls `each_second`. Open connections stay.
  void Close();

  /// Reads the TLS files if an address uses them. Errors: FailedPrecondition (TLS_UNUSABLE).
  absl::StatusOr<TlsFiles> ReadTls(const TlsPaths& paths) const;
  /// Uses these files for new connections.
  void ReplaceTls(const TlsFiles& files);

  /// Returns whether a connection is open. A connection without a name counts as open for ever. Any
  /// thread may call it.
  bool IsOpen(const std::string& connection) const;

  /// Returns why there is no place for the connection with this name. Any thread may call it.
  std::string WhyRefused(const std::string& connection) const {
    return gate_.WhyRefused(connection);
  }

  /// Number of connections that are open and have a place. Any thread may call it.
  size_t connection_count() const { return gate_.open_count(); }

  /// Sets the health of a service. Any thread may call it after Serve.
  void SetHealth(const std::string& service, bool serves) { servers_.SetHealth(service, serves); }

  /// Returns the addresses, with the chosen ports.
  const std::vector<std::string>& addresses() const { return addresses_; }

 private:
  static absl::StatusOr<std::deque<ListenAddress>> Parse(const EdgeSettings& settings);
  absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> Credentials(
      const ListenAddress& address);
  void Watch();

  const EdgeSettings settings_;
  CertificateEnd& certificate_end_;
  ConnectionGate gate_;
  FloodGuard guard_;
  GrpcServers servers_;
  /// The credentials of each TCP address.
  std::vector<std::shared_ptr<TlsCredentials>> tls_;
  std::vector<std::string> addresses_;
  std::function<void()> each_second_;
  std::atomic<bool> closing_{false};
  std::counting_semaphore<> wake_{0};  ///< wakes watch_
  /// Not the gate's thread, because gRPC may parse a flood there when it gets a connection.
  std::thread watch_;
};

}  // namespace carillon
