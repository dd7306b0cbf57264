// SPDX-License-Identifier: Apache-2.0
#include "server/api/api_server.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/chore.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/thread_pool.h"
#include "server/api/edge/access/access_control.h"
#include "server/api/edge/access/certificate_end.h"
#include "server/api/edge/client_limits.h"
#include "server/api/edge/edge.h"
#include "server/api/edge/grpc_log.h"
#include "server/api/edge/idle_calls.h"
#include "server/api/edge/scene_leases.h"
#include "server/api/edge/scene_owners.h"
#include "server/api/services/admin_service.h"
#include "server/api/services/audio_service.h"
#include "server/api/services/contact_service.h"
#include "server/api/services/decomposition_service.h"
#include "server/api/services/modal_model_service.h"
#include "server/api/services/reflection_service.h"
#include "server/api/services/refusing_service.h"
#include "server/api/services/scene_service.h"
#include "server/api/services/server_service.h"
#include "server/base/limited_log.h"
#include "server/mode_database/maintenance/database_keeper.h"

namespace carillon {
namespace {

constexpr int kCallThreadCount = 3;
/// Calls of AddObjects may occupy all call threads except one.
constexpr int kAddingThreadCount = kCallThreadCount - 1;
/// Calls that change the database wait for its write lock, which storing a large mesh holds for
/// seconds. They have a thread of their own, so that the other calls do not wait with them. With a
/// second thread, two of these calls would wait for each other's lock.
constexpr int kWriteThreadCount = 1;
/// Offline renderings and backups have a lower priority than live sound.
constexpr int kBackgroundThreadCount = 2;
constexpr int kBackgroundNiceness = 5;

std::chrono::nanoseconds Duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(seconds));
}

/// Returns the number of threads that take the steps of contact streams. One client may occupy half
/// of them.
int StepThreadCount() { return std::max(2, static_cast<int>(std::thread::hardware_concurrency())); }

absl::StatusOr<AccessTable> ReadAccess(const ApiSettings& settings) {
  if (settings.access_file.empty()) return AccessTable::ForThisMachine();
  return AccessTable::Read(settings.access_file);
}

EdgeSettings EdgeOf(const ApiSettings& settings) {
  return {.addresses = settings.addresses,
          .tls = settings.tls,
          .has_access_file = !settings.access_file.empty(),
          .client_share = settings.client_share};
}

absl::Status CheckHead(HeadStore& heads, const ApiSettings& settings, uint32_t sample_rate_hz) {
  // Without the setting, a scene that needs the usual head is refused when it asks for it.
  if (settings.head_file.empty()) return absl::OkStatus();
  return heads.Get(sample_rate_hz).status();
}

}  // namespace

struct ApiServer::State {
  State(const ApiSettings& settings, const ServedRooms& rooms, AccessTable table)
      : clock(rooms.clock),
        grpc_log(rooms.clock, rooms.log),
        client_log(rooms.clock, "clients", rooms.log),
        access(std::move(table), rooms.clock, rooms.log),
        events(rooms.clock, rooms.log_event),
        limits(settings.client_share),
        leases(rooms.clock, Duration(settings.scene_grace_s),
               [this](const std::string& connection) { return edge->IsOpen(connection); }),
        owners(access, leases, rooms.scenes),
        certificate_end(rooms.clock),
        database_keeper(rooms.database.database(),
                        [this](const absl::Status& state) { ShowDatabase(state); }),
        idle_limit(Duration(settings.rendering_idle_s)),
        live_scenes(rooms.scenes),
        admin({.database = rooms.database,
               .reception = reception,
               .writing = writing,
               .background = background,
               .copying = copying,
               .idle_calls = idle_calls,
               .clock = rooms.clock}),
        models({.database = rooms.database,
                .queue = rooms.decompositions,
                .reception = reception,
                .writing = writing,
                .idle_calls = idle_calls,
                .clock = rooms.clock,
                .sample_rate_hz = static_cast<double>(rooms.output.format().sample_rate_hz)}),
        decompositions(rooms.decompositions, reception, writing),
        heads(settings.head_file),
        scenes(rooms.scenes, owners, rooms.database, heads, reception, adding),
        contacts({.scenes = rooms.scenes,
                  .output = rooms.output,
                  .clock = rooms.clock,
                  .owners = owners,
                  .reception = reception,
                  .steps = steps}),
        audio({.version = settings.version,
               .output = rooms.output,
               .scenes = rooms.scenes,
               .owners = owners,
               .database = rooms.database,
               .heads = heads,
               .clock = rooms.clock,
               .idle_calls = idle_calls,
               .reception = background}),
        server_info({.version = settings.version,
                     .client_share = settings.client_share,
                     .scene_grace_s = settings.scene_grace_s,
                     .certificate_end = certificate_end,
                     .binaural = heads.available(),
                     .slurm = settings.slurm,
                     .can_decompose = [this] { return decomposes.load(); }},
                    rooms.decompositions, rooms.output, rooms.clock),
        output(rooms.output),
        log(rooms.log),
        log_error(rooms.log_error),
        log_event(rooms.log_event),
        check_decomposition(rooms.check_decomposition) {}

  absl::Status Listen(const ApiSettings& settings);
  /// Begins to accept connections, and to look after the clients and the database.
  void Open();

  /// Looks after the clients and what they need. May wait for the scenes.
  void KeepClients();

  /// Ends the scenes whose leases are over.
  void EndScenes();

  /// Sets the health of DecompositionService when decompositions have become possible or
  /// impossible.
  void ShowWorkers(const absl::Status& state);

  /// Sets the health of ModalModelService and DecompositionService, and logs why the database
  /// cannot be changed, or that it can be changed again.
  void ShowDatabase(const absl::Status& state);

  const Clock& clock;
  GrpcLog grpc_log;
  LimitedLog client_log;
  AccessControl access;
  CallEvents events;
  ClientLimits limits;
  SceneLeases leases;
  SceneOwners owners;
  IdleCalls idle_calls;
  CertificateEnd certificate_end;
  DatabaseKeeper database_keeper;
  const std::chrono::nanoseconds idle_limit;
  SceneRegistry& live_scenes;
  // The pools end before the turns and chores, which their tasks use.
  Chore keep_clients{call_pool, [this] { KeepClients(); }};
  Chore keep_database{write_pool, [this] { database_keeper.Look(); }};
  FairTurns steps{step_pool, StepThreadCount()};
  FairTurns adding{call_pool, kAddingThreadCount};
  /// One thread, so that the other is left for renderings.
  FairTurns copying{background_pool, 1};
  ThreadPool step_pool{StepThreadCount()};
  ThreadPool call_pool{kCallThreadCount};
  ThreadPool write_pool{kWriteThreadCount};
  ThreadPool background_pool{kBackgroundThreadCount, kBackgroundNiceness};
  const Reception reception{access, limits, call_pool, events};
  const Reception writing{access, limits, write_pool, events};
  const Reception background{access, limits, background_pool, events};
  AdminService admin;
  ModalModelService models;
  DecompositionService decompositions;
  HeadStore heads;
  SceneService scenes;
  ContactService contacts;
  AudioService audio;
  ServerService server_info;
  LiveOutput& output;
  const std::function<void(const std::string& line)> log;
  const std::function<void(const std::string& line)> log_error;
  const EventSink log_event;
  const std::function<absl::Status()> check_decomposition;
  std::vector<std::unique_ptr<grpc::Service>> reflection;
  RefusingService refusing{
      [this](const std::string& connection) { return edge->WhyRefused(connection); }};
  std::optional<Edge> edge;
  std::atomic<bool> stores{true};
  std::atomic<bool> decomposes{true};
};

absl::Status ApiServer::State::Listen(const ApiSettings& settings) {
  std::vector<grpc::Service*> services = {&admin,    &models, &decompositions, &scenes,
                                          &contacts, &audio,  &server_info};
  reflection = MakeReflectionServices(
      {v1::AdminService::service_full_name(), v1::ModalModelService::service_full_name(),
       v1::DecompositionService::service_full_name(), v1::SceneService::service_full_name(),
       v1::ContactService::service_full_name(), v1::AudioService::service_full_name(),
       v1::ServerService::service_full_name(), "grpc.health.v1.Health"});
  for (const auto& service : reflection) services.push_back(service.get());
  edge.emplace(EdgeOf(settings), certificate_end, client_log);
  return edge->Serve(services, refusing);
}

void ApiServer::State::Open() {
  // A client that asks before the first look would learn that these services are unknown.
  edge->SetHealth(v1::ModalModelService::service_full_name(), stores);
  edge->SetHealth(v1::DecompositionService::service_full_name(), stores && decomposes);
  edge->Open([this] {
    keep_clients.Start();
    keep_database.Start();
  });
}

void ApiServer::State::EndScenes() {
  for (const uint64_t scene : leases.Expired()) {
    const std::string name = live_scenes.NameOf(scene);
    // A client may have deleted the scene meanwhile.
    const bool ended = live_scenes.DeleteScene(scene).ok();
    owners.Remove(scene);
    if (ended) client_log.Warn(absl::StrCat(name, " has ended: its clients have gone"));
  }
}

void ApiServer::State::KeepClients() {
  EndScenes();
  idle_calls.EndIdle(idle_limit);
  ShowWorkers(check_decomposition());
  if (const auto warning = certificate_end.WarningDue()) log(*warning);
}

void ApiServer::State::ShowWorkers(const absl::Status& state) {
  const bool can = state.ok();
  if (decomposes.exchange(can) == can) return;
  edge->SetHealth(v1::DecompositionService::service_full_name(), stores && can);
  if (can) {
    log_event(Event("decompositions_possible", LogLevel::kInfo));
  } else {
    log_event(Event("decompositions_impossible", LogLevel::kWarning)
                  .With("error", std::string(state.message())));
  }
}

void ApiServer::State::ShowDatabase(const absl::Status& state) {
  edge->SetHealth(v1::ModalModelService::service_full_name(), state.ok());
  const bool stored = stores.exchange(state.ok());
  edge->SetHealth(v1::DecompositionService::service_full_name(), stores && decomposes);
  if (!state.ok()) log_error(std::string(state.message()));
  if (state.ok() && !stored) log("the database can be changed again");
}

absl::Status ApiServer::Check(const ApiSettings& settings, uint32_t sample_rate_hz) {
  RETURN_IF_ERROR(ReadAccess(settings).status());
  RETURN_IF_ERROR(Edge::Check(EdgeOf(settings)));
  HeadStore heads(settings.head_file);
  return CheckHead(heads, settings, sample_rate_hz);
}

absl::StatusOr<std::unique_ptr<ApiServer>> ApiServer::Start(const ApiSettings& settings,
                                                            const ServedRooms& rooms) {
  ASSIGN_OR_RETURN(AccessTable table, ReadAccess(settings));
  auto state = std::make_unique<State>(settings, rooms, std::move(table));
  RETURN_IF_ERROR(CheckHead(state->heads, settings, rooms.output.format().sample_rate_hz));
  RETURN_IF_ERROR(state->Listen(settings));
  rooms.output.ObserveDevice([&edge = *state->edge](bool plays) {
    edge.SetHealth(v1::AudioService::service_full_name(), plays);
  });
  std::unique_ptr<ApiServer> server(new ApiServer(std::move(state)));
  server->state_->Open();
  return server;
}

absl::Status ApiServer::Reload(const ApiSettings& settings) {
  ASSIGN_OR_RETURN(AccessTable table, ReadAccess(settings));
  ASSIGN_OR_RETURN(const TlsFiles files, state_->edge->ReadTls(settings.tls));
  state_->edge->ReplaceTls(files);
  state_->access.Replace(std::move(table));
  return absl::OkStatus();
}

ApiServer::ApiServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

void ApiServer::KeepLibrary() { grpc_init(); }

ApiServer::~ApiServer() {
  state_->edge->Close();
  state_->keep_clients.Stop();
  state_->keep_database.Stop();
  state_->output.ObserveDevice(nullptr);
  state_->edge.reset();
}

ClientCounts ApiServer::clients() const {
  const ClientLimits& limits = state_->limits;
  return {.connections = state_->edge->connection_count(),
          .contact_streams = limits.count(Holding::kContactStream),
          .listeners = limits.count(Holding::kListener),
          .renderings = limits.count(Holding::kRendering)};
}

bool ApiServer::serves_decompositions() const { return state_->stores && state_->decomposes; }

std::optional<double> ApiServer::certificate_left_s() const {
  return state_->certificate_end.left_s();
}

const std::vector<std::string>& ApiServer::addresses() const { return state_->edge->addresses(); }

}  // namespace carillon
