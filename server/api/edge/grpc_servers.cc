// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/grpc_servers.h"

#include <grpcpp/ext/health_check_service_server_builder_option.h>
#include <grpcpp/health_check_service_interface.h>

#include <array>
#include <functional>
#include <utility>

#include "absl/strings/match.h"
#include "proto/cpp/limits.h"
#include "server/api/edge/client_limits.h"

namespace carillon {
namespace {

using Acceptor = grpc::experimental::ExternalConnectionAcceptor;

/// Greatest number of open calls on one connection. gRPC makes further calls wait in the client,
/// but only after the client has confirmed this limit.
constexpr int kMostConcurrentCalls = 256;
/// Time within which a new connection must send its HTTP/2 settings and, with TLS, complete its
/// handshake.
constexpr int kHandshakeLimit_ms = 5'000;
/// A connection without traffic gets a ping after kKeepalive_ms, and is closed if no answer comes
/// within kKeepaliveAnswer_ms.
constexpr int kKeepalive_ms = 30'000;
constexpr int kKeepaliveAnswer_ms = 10'000;
/// Time for which a connection without a place stays open for its calls, and again for their end.
constexpr int kRefusal_ms = 1'000;
/// With 0, any number of pings is answered. With a limit, gRPC 1.51 closes the connection only
/// after all its data is sent, and keeps 1 kB for each ping that comes meanwhile.
constexpr int kNoPingStrikes = 0;
/// The daemon takes no compressed messages, because gRPC 1.51 unpacks a message before it compares
/// the size with a limit: 2 MiB that are packed well need 2 GiB.
constexpr int kIdentityOnly = 1 << GRPC_COMPRESS_NONE;
/// Bytes of a connection that are parsed before other connections have their turn. With gRPC's
/// default of 4 MiB, a few connections that begin and cancel calls keep all threads busy for
/// seconds.
constexpr int kReadBytes = 16 << 10;

constexpr size_t kCount = 2 + GrpcServers::kTcpCount;
constexpr size_t kUnixServer = 0;
constexpr size_t kRefusingServer = kCount - 1;

/// Returns which server a process or address uses.
size_t ServerOf(const std::string& source) {
  if (absl::StartsWith(source, "unix:")) return kUnixServer;
  return 1 + std::hash<std::string>()(source) % GrpcServers::kTcpCount;
}

/// Hands each connection to the server of its process or address.
class GrpcTaker final : public ConnectionTaker {
 public:
  using Acceptors = std::array<std::unique_ptr<Acceptor>, kCount>;
  explicit GrpcTaker(Acceptors acceptors) : acceptors_(std::move(acceptors)) {}

  void Take(int connection, const std::string& source) override {
    Acceptor::NewConnectionParameters parameters;
    parameters.fd = connection;
    acceptors_[ServerOf(source)]->HandleNewConnection(&parameters);
  }

  void Refuse(int connection) override {
    Acceptor::NewConnectionParameters parameters;
    parameters.fd = connection;
    acceptors_[kRefusingServer]->HandleNewConnection(&parameters);
  }

 private:
  const Acceptors acceptors_;
};

/// Bounds the resources of each connection, and of all connections of the server together.
void LimitClients(size_t memory_bytes, grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMostConcurrentCalls);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeLimit_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepalive_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveAnswer_ms);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, kNoPingStrikes);
  builder.AddChannelArgument(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, kIdentityOnly);
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  builder.AddChannelArgument(GRPC_ARG_TCP_READ_CHUNK_SIZE, kReadBytes);
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kReadBytes);
  grpc::ResourceQuota quota;
  quota.Resize(memory_bytes);
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(static_cast<int>(kMaxMessageBytes));
}

}  // namespace

GrpcServers::GrpcServers() {
  // Builders that are made later add health to their servers.
  grpc::EnableDefaultHealthCheckService(true);
  for (size_t i = 0; i < kCount; ++i) {
    builders_.push_back(std::make_unique<grpc::ServerBuilder>());
    LimitClients(i == kUnixServer ? kUnixMemoryBytes : kTcpMemoryBytes, *builders_.back());
  }
  grpc::ServerBuilder& refusing = *builders_[kRefusingServer];
  refusing.SetOption(std::make_unique<grpc::HealthCheckServiceServerBuilderOption>(nullptr));
  refusing.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, kRefusal_ms);
  refusing.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, kRefusal_ms);
}

GrpcServers::~GrpcServers() {
  const auto end = std::chrono::system_clock::now() + kGracePeriod;
  for (const auto& server : servers_) server->Shutdown(end);
  for (const auto& server : servers_) server->Wait();
}

std::unique_ptr<ConnectionTaker> GrpcServers::AddTaker(
    const std::shared_ptr<grpc::ServerCredentials>& credentials) {
  GrpcTaker::Acceptors acceptors;
  for (size_t i = 0; i < kCount; ++i) {
    acceptors[i] = builders_[i]->experimental().AddExternalConnectionAcceptor(
        grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials);
  }
  return std::make_unique<GrpcTaker>(std::move(acceptors));
}

bool GrpcServers::Start(absl::Span<grpc::Service* const> services,
                        grpc::CallbackGenericService& refusing) {
  for (const auto& builder : builders_) {
    if (builder == builders_[kRefusingServer]) {
      builder->RegisterCallbackGenericService(&refusing);
    } else {
      for (grpc::Service* service : services) builder->RegisterService(service);
    }
    std::unique_ptr<grpc::Server> server = builder->BuildAndStart();
    if (!server) return false;
    servers_.push_back(std::move(server));
  }
  return true;
}

void GrpcServers::SetHealth(const std::string& service, bool serves) {
  for (size_t i = 0; i < kRefusingServer; ++i) {
    servers_[i]->GetHealthCheckService()->SetServingStatus(service, serves);
  }
}

}  // namespace carillon
