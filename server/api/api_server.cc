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
#include "server/api/call/chore.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/thread_pool.h"
#include "server/api/call/timetable.h"
#include "server/api/edge/access_control.h"
#include "server/api/edge/certificate_end.h"
#include "server/api/edge/client_keeper.h"
#include "server/api/edge/client_limits.h"
#include "server/api/edge/connection_gate.h"
#include "server/api/edge/flood_guard.h"
#include "server/api/edge/grpc_log.h"
#include "server/api/edge/idle_calls.h"
#include "server/api/edge/listen_address.h"
#include "server/api/edge/scene_leases.h"
#include "server/api/edge/scene_owners.h"
#include "server/api/edge/tls_credentials.h"
#include "server/api/grpc_servers.h"
#include "server/api/services/admin_service.h"
#include "server/api/services/audio_service.h"
#include "server/api/services/contact_service.h"
#include "server/api/services/decomposition_service.h"
#include "server/api/services/job_run_service.h"
#include "server/api/services/modal_model_service.h"
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
constexpr int kBackgroundNiceness = 10;

constexpr std::chrono::milliseconds kClientPeriod(250);
constexpr std::chrono::seconds kDatabasePeriod(1);

std::chrono::nanoseconds Duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(seconds));
}

/// Returns the number of threads that take the steps of contact streams. One client may occupy half
/// of them.
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
    if (std::ranges::any_of(
            addresses, [&](const ListenAddress& other) { return IsSameAddress(address, other); })) {
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_ADDRESS",
                     absl::StrCat("--listen names ", text, " twice: name each address once"));
    }
    addresses.push_back(std::move(address));
  }
  return addresses;
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
               [this](const std::string& connection) { return IsOpen(connection); }),
        owners(access, leases, rooms.scenes),
        certificate_end(rooms.clock),
        database_keeper(rooms.database.database(),
                        [this](const absl::Status& state) { ShowDatabase(state); }),
        client_keeper({.scenes = rooms.scenes,
                       .owners = owners,
                       .idle_calls = idle_calls,
                       .idle_limit = Duration(settings.rendering_idle_s),
                       .log = [this](const std::string& line) { client_log.Warn(line); }}),
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
        job_runs(rooms.runs, access, call_pool),
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
  absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> Credentials(const ListenAddress& address,
                                                                       const ApiSettings& settings);

  /// Returns whether a connection is open. A connection without a name counts as open for ever.
  bool IsOpen(const std::string& connection) const {
    return connection == "unix:" || gate->IsOpen(connection);
  }

  /// Looks after the clients and what they need. May wait for the scenes.
  void KeepClients();

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
  const ClientKeeper client_keeper;
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
  JobRunService job_runs;
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
  /// The credentials of each TCP address.
  std::vector<std::shared_ptr<TlsCredentials>> tls;
  std::optional<GrpcServers> servers;
  std::optional<ConnectionGate> gate;
  std::optional<FloodGuard> flood_guard;
  /// Not on the gate's thread, because gRPC may parse a flood there when it gets a connection.
  Timetable timetable;
  std::atomic<bool> stores{true};
  std::atomic<bool> decomposes{true};
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
  servers.emplace(idle_calls, clock);
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
  for (const ListenAddress& address : parsed) addresses.push_back(address.ToString());
  return absl::OkStatus();
}

void ApiServer::State::Open() {
  const auto repeat = [this](Chore& chore, Timetable::Clock::duration period) {
    timetable.Add([&chore, period] {
      chore.Start();
      return period;
    });
  };
  repeat(keep_clients, kClientPeriod);
  repeat(keep_database, kDatabasePeriod);
  flood_guard.emplace(*gate, client_log);
  timetable.Add([this] { return flood_guard->Look(); });
  gate->Open();
  timetable.Start();
}

void ApiServer::State::KeepClients() {
  client_keeper.Look();
  ShowWorkers(check_decomposition());
  if (const auto warning = certificate_end.WarningDue()) log(*warning);
}

void ApiServer::State::ShowWorkers(const absl::Status& state) {
  const bool can = state.ok();
  if (decomposes.exchange(can) == can) return;
  servers->SetHealth(v1::DecompositionService::service_full_name(), stores && can);
  if (can) {
    log_event(Event("decompositions_possible", LogLevel::kInfo));
  } else {
    log_event(Event("decompositions_impossible", LogLevel::kWarning)
                  .With("error", std::string(state.message())));
  }
}

void ApiServer::State::ShowDatabase(const absl::Status& state) {
  servers->SetHealth(v1::ModalModelService::service_full_name(), state.ok());
  const bool stored = stores.exchange(state.ok());
  servers->SetHealth(v1::DecompositionService::service_full_name(), stores && decomposes);
  if (!state.ok()) log_error(std::string(state.message()));
  if (state.ok() && !stored) log("the database can be changed again");
}

absl::Status ApiServer::Check(const ApiSettings& settings, uint32_t sample_rate_hz) {
  RETURN_IF_ERROR(ReadAccess(settings).status());
  ASSIGN_OR_RETURN(const std::deque<ListenAddress> addresses, ParseAddresses(settings));
  for (const ListenAddress& address : addresses) {
    if (address.is_unix()) RETURN_IF_ERROR(CheckSocket(address.socket_path));
  }
  const bool serves_tls =
      !settings.tls.certificate.empty() && !std::ranges::all_of(addresses, &ListenAddress::is_unix);
  if (serves_tls) RETURN_IF_ERROR(ReadTlsFiles(settings.tls).status());
  HeadStore heads(settings.head_file);
  return CheckHead(heads, settings, sample_rate_hz);
}

absl::StatusOr<std::unique_ptr<ApiServer>> ApiServer::Start(const ApiSettings& settings,
                                                            const ServedRooms& rooms) {
  ASSIGN_OR_RETURN(AccessTable table, ReadAccess(settings));
  auto state = std::make_unique<State>(settings, rooms, std::move(table));
  RETURN_IF_ERROR(CheckHead(state->heads, settings, rooms.output.format().sample_rate_hz));
  RETURN_IF_ERROR(state->Listen(settings));
  rooms.output.ObserveDevice([&servers = *state->servers](bool plays) {
    servers.SetHealth(v1::AudioService::service_full_name(), plays);
  });
  std::unique_ptr<ApiServer> server(new ApiServer(std::move(state)));
  server->state_->Open();
  return server;
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

ApiServer::ApiServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

void ApiServer::KeepLibrary() { grpc_init(); }

ApiServer::~ApiServer() {
  state_->timetable.Stop();
  state_->gate->Close();
  state_->keep_clients.Stop();
  state_->keep_database.Stop();
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

bool ApiServer::serves_decompositions() const { return state_->stores && state_->decomposes; }

std::optional<double> ApiServer::certificate_left_s() const {
  return state_->certificate_end.left_s();
}

const std::vector<std::string>& ApiServer::addresses() const { return state_->addresses; }

}  // namespace carillon
