// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/base/clock.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/remote_runs.h"
#include "server/live_output/live_output.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Where and how to serve.
struct ApiSettings {
  /// "unix:PATH" or "HOST:PORT" (port 0: any that is free).
  std::vector<std::string> addresses;
  /// PEM files for all TCP addresses; empty: without TLS, on this machine's own addresses only.
  std::string tls_certificate_file;
  std::string tls_key_file;
  /// A file whose first line lets callers from the network do what administrators may; empty: only
  /// those on a Unix socket may.
  std::string admin_token_file{};
  /// Of the daemon.
  std::string version;
};

/// What is served; all of it must outlive the server.
struct ServedRooms {
  ModeDatabase& database;
  DecompositionQueue& decompositions;
  RemoteRuns& runs;
  SceneRegistry& scenes;
  LiveOutput& output;
  Clock& clock;
};

/// All services of carillon.v1, health and reflection.
class ApiServer {
 public:
  /// Serves once it returns. Errors: InvalidArgument (INVALID_ADDRESS), FailedPrecondition
  /// (TLS_REQUIRED: a network address without TLS, TLS_UNUSABLE, ADMIN_TOKEN_UNUSABLE,
  /// ADDRESS_IN_USE, LISTEN_FAILED).
  static absl::StatusOr<std::unique_ptr<ApiServer>> Start(const ApiSettings& settings,
                                                          const ServedRooms& rooms);

  /// Ends all calls, those that stream by cancelling them, and waits for them.
  ~ApiServer();
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;

  /// As in the settings, with the port that was chosen.
  const std::vector<std::string>& addresses() const;

 private:
  struct State;
  explicit ApiServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace carillon
