// SPDX-License-Identifier: Apache-2.0
//
// carillond: puts the rooms of the daemon together.

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"
#include "server/api/api_server.h"
#include "server/api/edge/client_limits.h"
#include "server/base/clock.h"
#include "server/daemon/daemon_log.h"
#include "server/daemon/daemon_metrics.h"
#include "server/daemon/data_directory.h"
#include "server/daemon/heap.h"
#include "server/daemon/options.h"
#include "server/daemon/room_settings.h"
#include "server/daemon/stop_signals.h"
#include "server/daemon/watchdog.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/worker/local_executor.h"
#include "server/decomposition/worker/slurm_executor.h"
#include "server/decomposition/worker/work_folder.h"
#include "server/live_output/live_output.h"
#include "server/metrics/metrics_server.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/scene_registry.h"

namespace carillon {
namespace {

constexpr char kVersion[] = CARILLON_VERSION;
/// Decompositions that may wait at a time.
constexpr size_t kMostQueuedJobs = 1024;

/// Reads the command line and the configuration file once more.
using ReadOptions = std::function<absl::StatusOr<CommandLine>()>;

void LogWarning(const std::string& line) { spdlog::warn("{}", line); }

void AnnounceReady(const ApiServer& server) {
  for (const std::string& address : server.addresses()) {
    std::cout << "listening on " << address << std::endl;
  }
  const int told = sd_notify(0, "READY=1");
  if (told >= 0) return;
  LogWarning(absl::StrCat("nobody takes the word that the daemon is ready at NOTIFY_SOCKET: ",
                          std::system_category().message(-told)));
}

void LogError(const std::string& line) { spdlog::error("{}", line); }

void LogInfo(const std::string& line) { spdlog::info("{}", line); }

void CollectUnusedMeshes(ModeDatabase& database) {
  const auto collected = database.meshes().Collect();
  if (!collected.ok()) return LogWarning(std::string(collected.status().message()));
  if (collected->mesh_count == 0) return;
  spdlog::info("{} meshes that no model or job refers to were deleted", collected->mesh_count);
}

/// SQLite maps the index of its log into memory, which all users of a database must share.
void WarnOfNetwork(const Database& database) {
  const std::string network = NetworkFileSystemOf(database.file());
  if (network.empty()) return;
  spdlog::warn(
      "{} is on {}: while that cannot be reached, the daemon waits or is killed (SIGBUS), and a "
      "program on another computer that opens the database damages it; choose a folder on a disk "
      "of this computer with --data-dir",
      database.file().string(), network);
}

/// Sets the budget of models, warns of a database on a network, and removes unused meshes.
void Tidy(ModeDatabase& database, const Options& options) {
  database.models().KeepWithin({.bytes = static_cast<uint64_t>(options.model_budget_mib) << 20U,
                                .log = LogWarning,
                                .log_event = LogEvent});
  WarnOfNetwork(database.database());
  CollectUnusedMeshes(database);
}

void LogOutput(const LiveOutput& output) {
  const OutputState state = output.state();
  spdlog::info("plays on {} at {} Hz with an output latency of {:.1f} ms", state.device,
               output.format().sample_rate_hz, state.latency_s * 1000);
}

absl::StatusOr<std::unique_ptr<Executor>> MakeExecutor(const Options& options, const Clock& clock) {
  if (!options.uses_slurm()) return MakeLocalExecutor(LocalExecutorOptionsOf(options), clock);
  SlurmExecutorOptions slurm;
  slurm.program = options.precompute_program;
  slurm.directory = options.slurm_directory;
  if (options.worker_count > 0) slurm.job_count = options.worker_count;
  if (options.job_memory_mib > 0) {
    slurm.memory_limit_bytes = static_cast<uint64_t>(options.job_memory_mib) << 20U;
  }
  slurm.time_limit = std::chrono::seconds(static_cast<int64_t>(options.job_time_s));
  return MakeSlurmExecutor(slurm);
}

absl::StatusOr<std::unique_ptr<DecompositionQueue>> MakeQueue(const Options& options,
                                                              ModeDatabase& database,
                                                              const Clock& clock) {
  ASSIGN_OR_RETURN(std::unique_ptr<Executor> executor, MakeExecutor(options, clock));
  return DecompositionQueue::Make(
      database, std::move(executor), clock,
      {.max_queued_count = kMostQueuedJobs,
       .max_queued_count_of_client = ClientLimits::ShareOf(kMostQueuedJobs, options.client_share),
       .transfers = options.transfers,
       .log = LogWarning,
       .log_event = LogEvent});
}

/// The present settings with those of `read` that can change while the daemon runs.
Options WithReloadable(Options present, const Options& read) {
  for (std::string Options::*const file :
       {&Options::tls_certificate_file, &Options::tls_key_file, &Options::tls_client_roots_file,
        &Options::access_file}) {
    if ((present.*file).empty() == (read.*file).empty()) present.*file = read.*file;
  }
  present.log_level = read.log_level;
  return present;
}

/// Applies the settings that can change while the daemon runs; says which cannot.
void Reload(const ReadOptions& read_options, Options& options, ApiServer& server) {
  sd_notify(0, "RELOADING=1");
  const absl::StatusOr<CommandLine> read = read_options();
  absl::Status status = read.status();
  Options changed = options;
  if (status.ok()) {
    changed = WithReloadable(options, read->options);
    status = server.Reload(ApiSettingsOf(changed));
  }
  if (status.ok()) {
    // The outcome is logged if the old level or the new one lets it through.
    LowerLogLevel(changed.log_level);
    if (const auto names = DifferentSettings(changed, read->options); !names.empty()) {
      spdlog::warn(
          "these changed settings need a restart: {}; a reload takes only the log level, the "
          "access file and the TLS files into account, and does not begin or end the use of a file",
          absl::StrJoin(names, ", "));
    }
    options = changed;
    spdlog::info(
        "the configuration, the access file and the TLS files were read again; the log level is {}",
        options.log_level);
    SetLogLevel(options.log_level);
  } else {
    spdlog::error("nothing was changed by the reload: {}", std::string(status.message()));
  }
  sd_notify(0, "READY=1");
}

/// Checks that decompositions can run, as far as this machine decides it.
absl::Status CheckDecomposition(const Options& options) {
  if (options.uses_slurm()) return absl::OkStatus();
  RETURN_IF_ERROR(CheckLocalExecutor(LocalExecutorOptionsOf(options)));
  return CheckWorkFolder(DataDirectory::WorkDirectory(options.data_directory));
}

/// Null if no metrics are wanted.
absl::StatusOr<std::unique_ptr<MetricsServer>> StartMetrics(const Options& options,
                                                            const MeasuredRooms& rooms) {
  if (options.metrics_address.empty()) return nullptr;
  return MetricsServer::Start(options.metrics_address, [rooms] { return ReadMetrics(rooms); });
}

/// Serves until a stop signal arrives, and lets the sound fade out.
absl::Status Serve(const MeasuredRooms& rooms, Options& options, const ReadOptions& read_options) {
  ASSIGN_OR_RETURN(const std::unique_ptr<MetricsServer> metrics, StartMetrics(options, rooms));
  LogOutput(rooms.output);
  CompleteStart();
  AnnounceReady(rooms.server);
  Watchdog watchdog(rooms.output);
  const RepeatedWork repeated{.period = watchdog.period(), .work = [&] {
                                watchdog.Report();
                                GiveMemoryBack();
                              }};
  WaitForStop([&] { Reload(read_options, options, rooms.server); }, LogInfo, repeated);
  sd_notify(0, "STOPPING=1");
  rooms.output.FadeOut();
  return absl::OkStatus();
}

/// Makes the parts of the daemon, and serves. Each part is made after the parts that it uses and
/// destroyed before them.
absl::Status Run(Options options, const ReadOptions& read_options) {
  SystemClock clock;
  ASSIGN_OR_RETURN(const DataDirectory directory, DataDirectory::Open(options.data_directory));
  ASSIGN_OR_RETURN(const std::unique_ptr<ModeDatabase> database,
                   ModeDatabase::Open(directory.database_file(), clock));
  Tidy(*database, options);
  ASSIGN_OR_RETURN(const std::unique_ptr<DecompositionQueue> decompositions,
                   MakeQueue(options, *database, clock));
  ASSIGN_OR_RETURN(const std::unique_ptr<LiveOutput> output,
                   LiveOutput::Start(OutputSettingsOf(options), clock, LogWarning));
  SceneRegistry scenes(output->mixer(), &database->transfers());
  database->transfers().Listen(
      [&scenes](const std::string& model_digest) { scenes.TakeOverTransfers(model_digest); });
  const absl::Cleanup listen_no_more = [&database] { database->transfers().Listen(nullptr); };
  ASSIGN_OR_RETURN(const std::unique_ptr<ApiServer> server,
                   ApiServer::Start(ApiSettingsOf(options), {.database = *database,
                                                             .decompositions = *decompositions,
                                                             .scenes = scenes,
                                                             .output = *output,
                                                             .clock = clock,
                                                             .log = LogWarning,
                                                             .log_error = LogError,
                                                             .log_event = LogEvent,
                                                             .check_decomposition = [options] {
                                                               return CheckDecomposition(options);
                                                             }}));
  return Serve({.version = kVersion,
                .output = *output,
                .scenes = scenes,
                .decompositions = *decompositions,
                .database = *database,
                .server = *server},
               options, read_options);
}

/// Prints what a database has.
absl::Status PrintContents(const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(const auto database, Database::Open(file));
  ASSIGN_OR_RETURN(const DatabaseStats stats, ReadStats(*database));
  std::cout << "models: " << stats.model_count << ", meshes: " << stats.mesh_count
            << ", jobs: " << stats.job_count << std::endl;
  return absl::OkStatus();
}

/// Checks a database, and prints its faults and what it has.
absl::Status Check(const std::filesystem::path& file) {
  int fault_count = 0;
  RETURN_IF_ERROR(CheckDatabase(file, [&fault_count](const std::string& line) {
    ++fault_count;
    std::cout << line << std::endl;
  }));
  RETURN_IF_ERROR(PrintContents(file));
  std::cout << fault_count << (fault_count == 1 ? " fault" : " faults") << std::endl;
  if (fault_count == 0) return absl::OkStatus();
  return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                 "the faults above were found: restore a backup with `carillond db restore`, or "
                 "import or compute the damaged models again");
}

/// Restores a database, and prints what it has now and where the old one is.
absl::Status Restore(const std::filesystem::path& file, const std::filesystem::path& copy) {
  ASSIGN_OR_RETURN(const std::filesystem::path kept, RestoreDatabase(file, copy));
  if (!kept.empty()) std::cout << "the old database is kept as " << kept.string() << std::endl;
  return PrintContents(file);
}

/// Logs an error, and returns the exit status that belongs to it.
int Fail(const absl::Status& status, int exit_status) {
  spdlog::error("{}", EscapedText(std::string(status.message())));
  return exit_status;
}

/// Runs the daemon until it is stopped. Returns the exit status.
int RunDaemon(const CommandLine& command, const ReadOptions& read_options) {
  HandleSignals();
  ApiServer::KeepLibrary();
  if (const absl::Status wrong = CheckRooms(command); !wrong.ok()) return Fail(wrong, kWrongUsage);
  const absl::Status status = Run(command.options, read_options);
  return status.ok() ? EXIT_SUCCESS : Fail(status, EXIT_FAILURE);
}

/// Checks the settings without running the daemon. Returns the exit status.
int CheckOnly(const CommandLine& command) {
  if (const absl::Status wrong = CheckRooms(command); !wrong.ok()) return Fail(wrong, kWrongUsage);
  std::cout << "the configuration is valid" << std::endl;
  return EXIT_SUCCESS;
}

/// Runs `carillond db check|restore`.
absl::Status RunDatabaseCommand(const CommandLine& command) {
  signal(SIGXFSZ, SIG_IGN);  // writing beyond a file-size limit then fails like a full disk
  const std::filesystem::path folder = command.options.data_directory;
  const bool restores = command.database_command == "restore";
  std::error_code ignored;
  const std::filesystem::file_status database =
      std::filesystem::symlink_status(folder / DataDirectory::kDatabaseName, ignored);
  if (!restores && !std::filesystem::exists(database)) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat("there is no database ", DataDirectory::kDatabaseName, " in ",
                                folder.string(), ": name its folder with --data-dir"));
  }
  ASSIGN_OR_RETURN(const DataDirectory directory, DataDirectory::Open(folder));
  const std::filesystem::path file = directory.database_file();
  return restores ? Restore(file, command.backup_file) : Check(file);
}

int Main(int argc, char* const* argv) {
  SetUpLog();
  const ReadOptions read_options = [=] { return ReadCommandLine(argc, argv, kVersion); };
  const absl::StatusOr<CommandLine> command = read_options();
  if (!command.ok()) return Fail(command.status(), kWrongUsage);
  if (!command->run) return EXIT_SUCCESS;
  if (command->only_print) {
    std::cout << PrintConfiguration(command->options);
    return EXIT_SUCCESS;
  }
  SetLogLevel(command->options.log_level);
  if (command->only_check) return CheckOnly(*command);
  if (command->database_command.empty()) {
    return RunDaemon(*command, read_options);
  }
  const absl::Status status = RunDatabaseCommand(*command);
  return status.ok() ? EXIT_SUCCESS : Fail(status, EXIT_FAILURE);
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) { return carillon::Main(argc, argv); }
