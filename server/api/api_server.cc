// SPDX-License-Identifier: Apache-2.0
#include "server/api/api_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <chrono>
#include <deque>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/admin_service.h"
#include "server/api/audio_service.h"
#include "server/api/connection_gate.h"
#include "server/api/contact_service.h"
#include "server/api/decomposition_service.h"
#include "server/api/job_run_service.h"
#include "server/api/listen_address.h"
#include "server/api/modal_model_service.h"
#include "server/api/scene_service.h"
#include "server/api/thread_pool.h"

namespace carillon {
namespace {

constexpr int kCallThreadCount = 4;
/// Offline rendering has a lower priority than all that is heard live.
constexpr int kRenderThreadCount = 2;
constexpr int kRenderNiceness = 10;
constexpr size_t kShortestToken = 16;
constexpr std::chrono::milliseconds kGracePeriod(500);
/// Further calls wait in the client until one has ended.
constexpr int kMaxCallsOfConnection = 256;
/// Time in which a new connection must have sent its HTTP/2 settings, and with TLS its handshake.
constexpr int kHandshakeLimit_ms = 5'000;
/// A connection without traffic is asked after the first time whether its client lives, and closed
/// after the second.
constexpr int kKeepalive_ms = 30'000;
constexpr int kKeepaliveAnswer_ms = 10'000;
/// Memory of all connections; beyond it gRPC refuses calls and connections.
constexpr size_t kClientMemoryBytes = size_t{512} << 20U;

absl::Status Unready(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kFailedPrecondition, reason, message);
}

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (!file || content.empty()) {
    return Unready("TLS_UNUSABLE", absl::StrCat("cannot read \"", path, "\""));
  }
  return content;
}

absl::StatusOr<std::string> ReadToken(const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path);
  std::string token;
  if (std::getline(file, token) && token.size() >= kShortestToken) return token;
  return Unready("ADMIN_TOKEN_UNUSABLE",
                 absl::StrCat("cannot read a token of at least ", kShortestToken,
                              " characters from \"", path, "\""));
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> TcpCredentials(
    const ApiSettings& settings) {
  if (settings.tls_certificate_file.empty() && settings.tls_key_file.empty()) {
    return grpc::InsecureServerCredentials();
  }
  ASSIGN_OR_RETURN(std::string certificate, ReadFile(settings.tls_certificate_file));
  ASSIGN_OR_RETURN(std::string key, ReadFile(settings.tls_key_file));
  grpc::SslServerCredentialsOptions options;
  options.pem_key_cert_pairs.push_back({std::move(key), std::move(certificate)});
  return grpc::SslServerCredentials(options);
}

absl::StatusOr<std::deque<ListenAddress>> ParseAddresses(const ApiSettings& settings) {
  const bool tls = !settings.tls_certificate_file.empty();
  std::deque<ListenAddress> addresses;
  for (const std::string& text : settings.addresses) {
    ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(text));
    if (!address.is_local() && !tls) {
      return Unready("TLS_REQUIRED",
                     absl::StrCat(text,
                                  " can be reached from the network, and everybody there could use "
                                  "the daemon; give --tls-certificate and --tls-key, or listen on "
                                  "127.0.0.1 or a Unix socket"));
    }
    addresses.push_back(std::move(address));
  }
  return addresses;
}

/// Hands connections to gRPC.
class GrpcTaker final : public ConnectionTaker {
 public:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;
  explicit GrpcTaker(std::unique_ptr<Acceptor> acceptor) : acceptor_(std::move(acceptor)) {}

  void Take(int connection) override {
    Acceptor::NewConnectionParameters parameters;
    parameters.fd = connection;
    acceptor_->HandleNewConnection(&parameters);
  }

 private:
  const std::unique_ptr<Acceptor> acceptor_;
};

/// Bounds what one connection, and all together, can take.
void LimitClients(grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxCallsOfConnection);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeLimit_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepalive_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveAnswer_ms);
  grpc::ResourceQuota quota("clients");
  quota.Resize(kClientMemoryBytes);
  builder.SetResourceQuota(quota);
}

}  // namespace

struct ApiServer::State {
  State(const ApiSettings& settings, const ServedRooms& rooms, std::string admin_token)
      : admin(rooms.database, std::move(admin_token), call_pool),
        models(rooms.database, rooms.decompositions, call_pool),
        decompositions(rooms.decompositions, call_pool),
        job_runs(rooms.runs, call_pool),
        scenes(rooms.scenes, rooms.database, call_pool),
        contacts({.scenes = rooms.scenes,
                  .output = rooms.output,
                  .clock = rooms.clock,
                  .pool = call_pool}),
        audio(settings.version, rooms.output, rooms.scenes, rooms.database, render_pool),
        output(rooms.output) {}

  absl::Status Listen(const ApiSettings& settings);

  ThreadPool call_pool{kCallThreadCount};
  ThreadPool render_pool{kRenderThreadCount, kRenderNiceness};
  AdminService admin;
  ModalModelService models;
  DecompositionService decompositions;
  JobRunService job_runs;
  SceneService scenes;
  ContactService contacts;
  AudioService audio;
  LiveOutput& output;
  std::unique_ptr<grpc::Server> server;
  std::optional<ConnectionGate> gate;
  std::vector<std::string> addresses;
};

absl::Status ApiServer::State::Listen(const ApiSettings& settings) {
  ASSIGN_OR_RETURN(std::deque<ListenAddress> parsed, ParseAddresses(settings));
  ASSIGN_OR_RETURN(const std::shared_ptr<grpc::ServerCredentials> tcp_credentials,
                   TcpCredentials(settings));
  grpc::ServerBuilder builder;
  LimitClients(builder);
  gate.emplace(RaiseConnectionLimit());
  for (ListenAddress& address : parsed) {
    auto acceptor = builder.experimental().AddExternalConnectionAcceptor(
        grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
        address.is_unix() ? grpc::InsecureServerCredentials() : tcp_credentials);
    RETURN_IF_ERROR(gate->Listen(address, std::make_unique<GrpcTaker>(std::move(acceptor))));
  }
  for (grpc::Service* service : std::initializer_list<grpc::Service*>{
           &admin, &models, &decompositions, &job_runs, &scenes, &contacts, &audio}) {
    builder.RegisterService(service);
  }
  server = builder.BuildAndStart();
  if (!server) {
    return Unready("LISTEN_FAILED",
                   "cannot serve: the TLS files do not belong together; see the line before");
  }
  gate->Open();
  for (const ListenAddress& address : parsed) addresses.push_back(address.ToString());
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<ApiServer>> ApiServer::Start(const ApiSettings& settings,
                                                            const ServedRooms& rooms) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  ASSIGN_OR_RETURN(std::string admin_token, ReadToken(settings.admin_token_file));
  auto state = std::make_unique<State>(settings, rooms, std::move(admin_token));
  RETURN_IF_ERROR(state->Listen(settings));
  rooms.output.ObserveDevice([health = state->server->GetHealthCheckService()](bool plays) {
    health->SetServingStatus(v1::AudioService::service_full_name(), plays);
  });
  return std::unique_ptr<ApiServer>(new ApiServer(std::move(state)));
}

absl::Status ApiServer::Reload(const ApiSettings& settings) {
  ASSIGN_OR_RETURN(std::string admin_token, ReadToken(settings.admin_token_file));
  state_->admin.set_token(std::move(admin_token));
  return absl::OkStatus();
}

ApiServer::ApiServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

ApiServer::~ApiServer() {
  state_->gate.reset();
  state_->output.ObserveDevice(nullptr);
  state_->server->Shutdown(std::chrono::system_clock::now() + kGracePeriod);
  state_->server->Wait();
}

const std::vector<std::string>& ApiServer::addresses() const { return state_->addresses; }

}  // namespace carillon
