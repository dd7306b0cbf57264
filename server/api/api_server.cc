// SPDX-License-Identifier: Apache-2.0
#include "server/api/api_server.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/access_control.h"
#include "server/api/admin_service.h"
#include "server/api/audio_service.h"
#include "server/api/certificate_end.h"
#include "server/api/client_keeper.h"
#include "server/api/client_limits.h"
#include "server/api/connection_gate.h"
#include "server/api/contact_service.h"
#include "server/api/decomposition_service.h"
#include "server/api/fair_pool.h"
#include "server/api/flood_guard.h"
#include "server/api/grpc_log.h"
#include "server/api/grpc_servers.h"
#include "server/api/idle_calls.h"
#include "server/api/job_run_service.h"
#include "server/api/limited_log.h"
#include "server/api/listen_address.h"
#include "server/api/modal_model_service.h"
#include "server/api/scene_leases.h"
#include "server/api/scene_owners.h"
#include "server/api/scene_service.h"
#include "server/api/server_service.h"
#include "server/api/thread_pool.h"
#include "server/api/tls_credentials.h"

namespace carillon {
namespace {

constexpr int kCallThreadCount = 4;
/// Calls that change the database wait for its write lock, which storing a large mesh holds for
/// seconds. They have threads of their own, so that the other calls do not wait with them.
constexpr int kWriteThreadCount = 2;
/// Offline rendering has a lower priority than live sound.
constexpr int kRenderThreadCount = 2;
constexpr int kRenderNiceness = 10;

std::chrono::nanoseconds Duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(seconds));
}

/// Returns the number of threads that take large steps of contact streams. One client may occupy
/// half of them.
int StepThreadCount() { return std::max(2, static_cast<int>(std::thread::hardware_concurrency())); }

absl::Status Unready(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kFailedPrecondition, reason, message);
}

absl::StatusOr<AccessTable> ReadAccess(const ApiSettings& settings) {
  if (settings.access_file.empty()) return AccessTable::ForThisMachine();
  return AccessTable::Read(settings.access_file);
}

absl::StatusOr<std::deque<ListenAddress>> ParseAddresses(const ApiSettings& settings) {
  std::deque<ListenAddress> addresses;
  for (const std::string& text : settings.addresses) {
    ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(text));
    if (!address.is_local() && settings.tls.certificate.empty()) {
      return Unready("TLS_REQUIRED",
                     absl::StrCat(text,
                                  " can be reached from the network, and everybody there could use "
                                  "the daemon; give --tls-certificate and --tls-key, or listen on "
                                  "127.0.0.1 or a Unix socket"));
    }
    if (!address.is_local() && settings.access_file.empty()) {
      return Unready("ACCESS_FILE_REQUIRED",
                     absl::StrCat(text,
                                  " can be reached from the network; say who may do what there: "
                                  "give --access-file"));
    }
    addresses.push_back(std::move(address));
  }
  return addresses;
}

}  // namespace

struct ApiServer::State {
  State(const ApiSettings& settings, const ServedRooms& rooms, AccessTable table)
      : grpc_log(rooms.clock, rooms.log),
        client_log(rooms.clock, rooms.log),
        access(std::move(table), rooms.clock, rooms.log),
        limits(settings.client_share),
        leases(rooms.clock, Duration(settings.scene_grace_s),
               [this](const std::string& connection) { return IsOpen(connection); }),
        owners(access, leases, rooms.scenes),
        admin(rooms.database, reception, writing, idle_calls, rooms.clock),
        models({.database = rooms.database,
                .queue = rooms.decompositions,
                .reception = reception,
                .writing = writing,
                .idle_calls = idle_calls,
                .clock = rooms.clock}),
        decompositions(rooms.decompositions, reception, writing),
        job_runs(rooms.runs, access, call_pool),
        heads(settings.head_file),
        scenes(rooms.scenes, owners, rooms.database, heads, reception),
        contacts({.scenes = rooms.scenes,
                  .output = rooms.output,
                  .clock = rooms.clock,
                  .owners = owners,
                  .reception = reception,
                  .large_steps = large_steps}),
        audio({.version = settings.version,
               .output = rooms.output,
               .scenes = rooms.scenes,
               .owners = owners,
               .database = rooms.database,
               .heads = heads,
               .clock = rooms.clock,
               .idle_calls = idle_calls,
               .reception = {access, limits, render_pool}}),
        certificate_end(rooms.clock),
        server_info({.version = settings.version,
                     .client_share = settings.client_share,
                     .scene_grace_s = settings.scene_grace_s,
                     .certificate_end = certificate_end,
                     .binaural = heads.available(),
                     .slurm = settings.slurm,
                     .can_decompose = rooms.can_decompose},
                    rooms.decompositions, rooms.output, rooms.clock),
        output(rooms.output) {}

  absl::Status Listen(const ApiSettings& settings);
  absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> Credentials(const ListenAddress& address,
                                                                       const ApiSettings& settings);

  /// Returns whether a connection is open. A connection without a name counts as open for ever.
  bool IsOpen(const std::string& connection) const {
    return connection == "unix:" || gate->IsOpen(connection);
  }

  /// Sets the health of DecompositionService when decompositions have become possible or
  /// impossible.
  void ShowWorkers(bool can) {
    if (can_decompose.exchange(can) == can) return;
    servers->SetHealth(v1::DecompositionService::service_full_name(), stores && can);
    if (!can) client_log.Warn("decompositions cannot run: their program is missing");
  }

  GrpcLog grpc_log;
  LimitedLog client_log;
  AccessControl access;
  ClientLimits limits;
  SceneLeases leases;
  SceneOwners owners;
  IdleCalls idle_calls;
  FairPool large_steps{StepThreadCount()};
  ThreadPool call_pool{kCallThreadCount};
  ThreadPool write_pool{kWriteThreadCount};
  ThreadPool render_pool{kRenderThreadCount, kRenderNiceness};
  const Reception reception{access, limits, call_pool};
  const Reception writing{access, limits, write_pool};
  AdminService admin;
  ModalModelService models;
  DecompositionService decompositions;
  JobRunService job_runs;
  HeadStore heads;
  SceneService scenes;
  ContactService contacts;
  AudioService audio;
  CertificateEnd certificate_end;
  ServerService server_info;
  LiveOutput& output;
  /// The credentials of each TCP address.
  std::vector<std::shared_ptr<TlsCredentials>> tls;
  std::optional<GrpcServers> servers;
  std::optional<ConnectionGate> gate;
  std::optional<ClientKeeper> keeper;
  std::optional<FloodGuard> flood_guard;
  std::atomic<bool> stores{true};
  std::atomic<bool> can_decompose{true};
  std::vector<std::string> addresses;
};

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> ApiServer::State::Credentials(
    const ListenAddress& address, const ApiSettings& settings) {
  if (address.is_unix() || settings.tls.certificate.empty()) {
    return grpc::InsecureServerCredentials();
  }
  ASSIGN_OR_RETURN(TlsFiles files, ReadTlsFiles(settings.tls));
  certificate_end.Set(files.end_unix_s);
  tls.push_back(std::make_shared<TlsCredentials>(std::move(files)));
  return tls.back();
}

absl::Status ApiServer::State::Listen(const ApiSettings& settings) {
  ASSIGN_OR_RETURN(std::deque<ListenAddress> parsed, ParseAddresses(settings));
  servers.emplace();
  gate.emplace(RaiseConnectionLimit(), settings.client_share, &client_log);
  for (ListenAddress& address : parsed) {
    ASSIGN_OR_RETURN(const std::shared_ptr<grpc::ServerCredentials> credentials,
                     Credentials(address, settings));
    RETURN_IF_ERROR(gate->Listen(address, servers->AddTaker(credentials)));
  }
  if (!servers->Start({{admin, v1::AdminService::service_full_name()},
                       {models, v1::ModalModelService::service_full_name()},
                       {decompositions, v1::DecompositionService::service_full_name()},
                       {job_runs, v1::JobRunService::service_full_name()},
                       {scenes, v1::SceneService::service_full_name()},
                       {contacts, v1::ContactService::service_full_name()},
                       {audio, v1::AudioService::service_full_name()},
                       {server_info, v1::ServerService::service_full_name()}})) {
    return Unready("LISTEN_FAILED",
                   "cannot serve: gRPC does not take the TLS files; see the line before");
  }
  gate->Open();
  flood_guard.emplace(*gate, client_log);
  for (const ListenAddress& address : parsed) addresses.push_back(address.ToString());
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<ApiServer>> ApiServer::Start(const ApiSettings& settings,
                                                            const ServedRooms& rooms) {
  ASSIGN_OR_RETURN(AccessTable table, ReadAccess(settings));
  auto state = std::make_unique<State>(settings, rooms, std::move(table));
  if (!settings.head_file.empty()) {
    const uint32_t rate_hz = rooms.output.format().sample_rate_hz;
    RETURN_IF_ERROR(state->heads.Get(rate_hz).status());
  }
  RETURN_IF_ERROR(state->Listen(settings));
  state->keeper.emplace(ClientKeeper::Kept{
      .scenes = rooms.scenes,
      .owners = state->owners,
      .idle_calls = state->idle_calls,
      .idle_limit = Duration(settings.rendering_idle_s),
      .log = [log = &state->client_log](const std::string& line) { log->Warn(line); },
      .tick =
          [state = state.get(), can_decompose = rooms.can_decompose] {
            state->ShowWorkers(can_decompose());
            if (const auto warning = state->certificate_end.WarningDue()) {
              state->client_log.Warn(*warning);
            }
          }});
  rooms.output.ObserveDevice([&servers = *state->servers](bool plays) {
    servers.SetHealth(v1::AudioService::service_full_name(), plays);
  });
  return std::unique_ptr<ApiServer>(new ApiServer(std::move(state)));
}

absl::Status ApiServer::Reload(const ApiSettings& settings) {
  ASSIGN_OR_RETURN(AccessTable table, ReadAccess(settings));
  TlsFiles files;
  if (!state_->tls.empty()) {
    ASSIGN_OR_RETURN(files, ReadTlsFiles(settings.tls));
  }
  for (const auto& credentials : state_->tls) credentials->Replace(files);
  state_->certificate_end.Set(files.end_unix_s);
  state_->access.Replace(std::move(table));
  return absl::OkStatus();
}

void ApiServer::ShowDatabaseHealth(bool stores) {
  GrpcServers& servers = *state_->servers;
  servers.SetHealth(v1::ModalModelService::service_full_name(), stores);
  state_->stores = stores;
  servers.SetHealth(v1::DecompositionService::service_full_name(), stores && state_->can_decompose);
}

ApiServer::ApiServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

ApiServer::~ApiServer() {
  state_->flood_guard.reset();
  state_->gate->Close();
  state_->keeper.reset();
  state_->output.ObserveDevice(nullptr);
  state_->servers.reset();
}

ClientCounts ApiServer::clients() const {
  const ClientLimits& limits = state_->limits;
  return {.connections = state_->gate->open_count(),
          .contact_streams = limits.count(Holding::kContactStream),
          .listeners = limits.count(Holding::kListener),
          .renderings = limits.count(Holding::kRendering)};
}

std::optional<double> ApiServer::certificate_left_s() const {
  return state_->certificate_end.left_s();
}

const std::vector<std::string>& ApiServer::addresses() const { return state_->addresses; }

}  // namespace carillon
