// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "server/api/edge/connection_gate.h"

namespace carillon {

/// Several gRPC servers with the same services: one for Unix sockets, and one for each group of
/// addresses over TCP. One more tells the clients of other connections why there is no place for
/// them.
///
/// gRPC bounds the memory of a server. Beyond the bound it ends calls of any connection of this
/// server, also of connections that take little memory. One client with unfinished messages would
/// therefore end the streams of all others, if there were only one server.
class GrpcServers {
 public:
  /// Number of groups of addresses.
  static constexpr size_t kTcpCount = 3;

  /// Memory that gRPC may take for the connections over Unix sockets.
  static constexpr size_t kUnixMemoryBytes = size_t{256} << 20U;

  GrpcServers();

  /// Cancels the calls that have not ended kGracePeriod later, and waits until all have ended.
  ~GrpcServers();
  GrpcServers(const GrpcServers&) = delete;
  GrpcServers& operator=(const GrpcServers&) = delete;

  /// Returns a taker that hands connections to the servers. The taker must not be used after the
  /// servers are destroyed. The caller must call AddTaker before Start.
  std::unique_ptr<ConnectionTaker> AddTaker(
      const std::shared_ptr<grpc::ServerCredentials>& credentials);

  /// Starts all servers with these services and health. `refusing` answers the calls of connections
  /// without a place. Returns false if gRPC does not take the credentials. The services must
  /// outlive the servers.
  bool Start(absl::Span<grpc::Service* const> services, grpc::CallbackGenericService& refusing);

  /// Sets the health of a service. Any thread may call it after Start.
  void SetHealth(const std::string& service, bool serves);

 private:
  static constexpr std::chrono::milliseconds kGracePeriod{500};

  std::vector<std::unique_ptr<grpc::ServerBuilder>> builders_;
  std::vector<std::unique_ptr<grpc::Server>> servers_;
};

}  // namespace carillon
