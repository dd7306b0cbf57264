// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/api/edge/access/tls_files.h"
#include "server/base/clock.h"
#include "server/base/event.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/live_output/live_output.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// The addresses at which the server listens, and the files that protect them.
struct ApiSettings {
  /// "unix:PATH" or "HOST:PORT". Port 0 stands for any free port.
  std::vector<std::string> addresses{};
  /// PEM files for all TCP addresses. If they are empty, there is no TLS, and only addresses of
  /// this machine are allowed.
  TlsPaths tls{};
  /// Path of the access file, which has the callers over TCP and their roles (AccessTable). If it
  /// is empty, only addresses of this machine are allowed, and everybody may do everything except
  /// administer.
  std::string access_file{};
  /// SOFA file with the head for binaural scenes. If it is empty, HeadStore's file is used.
  std::string head_file{};
  /// Version of the daemon.
  std::string version{};
  /// Seconds for which a scene waits for its clients to come back.
  double scene_grace_s = 60;
  /// Share of all scenes, streams, listeners and renderings that one client may hold; above 0, at
  /// most 1.
  double client_share = 0.5;
  /// Seconds after which a rendering ends if its client neither sends nor reads.
  double rendering_idle_s = 60;
  /// Whether decompositions run on the cluster that Slurm manages.
  bool slurm = false;
};

/// The rooms that the server serves. All of them must outlive it.
struct ServedRooms {
  ModeDatabase& database;
  DecompositionQueue& decompositions;
  SceneRegistry& scenes;
  LiveOutput& output;
  Clock& clock;
  std::function<void(const std::string& line)> log;  ///< takes warnings
  /// Takes lines that say why the database cannot be changed.
  std::function<void(const std::string& line)> log_error = [](const std::string&) {};
  EventSink log_event = [](const Event&) {};  ///< takes what calls have done
  /// Returns why decompositions cannot run, or OK. Called several times a second.
  std::function<absl::Status()> check_decomposition = [] { return absl::OkStatus(); };
};

/// The numbers of scenes, streams, listeners and renderings that clients hold at one moment.
struct ClientCounts {
  size_t connections = 0;
  size_t contact_streams = 0;
  size_t listeners = 0;
  size_t renderings = 0;
};

/// A gRPC server with all services of carillon.v1, health and reflection. The health of
/// carillon.v1.AudioService is NOT_SERVING while the wanted sound device does not play, that of
/// carillon.v1.ModalModelService while the database cannot be changed, and that of
/// carillon.v1.DecompositionService also while decompositions cannot run. The health of the whole
/// server ("") is SERVING.
class ApiServer {
 public:
  /// Keeps gRPC's library until the process ends. By itself, gRPC 1.51 stops its threads when its
  /// last object is destroyed, and may wait 10 s for one that polls. A process calls it once.
  static void KeepLibrary();

  /// Checks the settings by the rules of Start, without opening a socket or changing anything.
  /// Errors: those of Start that do not depend on what other processes do, FailedPrecondition
  /// (HEAD_UNUSABLE).
  static absl::Status Check(const ApiSettings& settings, uint32_t sample_rate_hz);

  /// Starts to serve. Calls are answered as soon as Start has returned. Errors: InvalidArgument
  /// (INVALID_CONFIGURATION), FailedPrecondition (TLS_REQUIRED, ACCESS_FILE_REQUIRED: a network
  /// address without TLS or without an access file, TLS_UNUSABLE, ACCESS_FILE_UNUSABLE,
  /// LISTEN_FAILED).
  static absl::StatusOr<std::unique_ptr<ApiServer>> Start(const ApiSettings& settings,
                                                          const ServedRooms& rooms);

  /// Cancels all calls, and waits until their steps have ended.
  ~ApiServer();
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

  /// Reads the access file and the TLS files anew. Connections and calls go on. Errors: those of
  /// Start about these files; an error changes nothing.
  absl::Status Reload(const ApiSettings& settings);

  ClientCounts clients() const;

  /// Returns whether decompositions can run and their results be stored.
  bool serves_decompositions() const;

  /// Returns the seconds until the first of the daemon's certificates expires, or nothing without
  /// TLS.
  std::optional<double> certificate_left_s() const;

  /// Returns the addresses of the settings, with the chosen ports.
  const std::vector<std::string>& addresses() const;

 private:
  struct State;
  explicit ApiServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace carillon
