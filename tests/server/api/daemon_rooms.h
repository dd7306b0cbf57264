// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/api/api_server.h"
#include "server/base/mutex.h"
#include "server/decomposition/worker/local_executor.h"
#include "server/live_output/live_output.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {

/// All rooms of a daemon, on the null device, and what it serves on a Unix socket. Its
/// decompositions fail: the worker is a program that only exits.
struct DaemonRooms {
  /// Serves; of `settings`, the addresses and the version are set here. `more` are further
  /// addresses.
  void Serve(ApiSettings settings, const std::vector<std::string>& more = {}) {
    settings.addresses = {address};
    settings.addresses.insert(settings.addresses.end(), more.begin(), more.end());
    settings.version = "test";
    server = *ApiServer::Start(settings, {.database = *database,
                                          .decompositions = *queue,
                                          .scenes = scenes,
                                          .output = *output,
                                          .clock = clock,
                                          .log = [this](const std::string& line) { Note(line); },
                                          .log_event = [this](const Event& event) { Note(event); },
                                          .check_decomposition = [] { return absl::OkStatus(); }});
  }

  std::unique_ptr<DecompositionQueue> MakeQueue() {
    LocalExecutorOptions options;
    options.program = "/bin/false";
    options.directory = folder / "work";
    return *DecompositionQueue::Make(*database, *MakeLocalExecutor(options, clock), clock,
                                     {.log_event = [this](const Event& event) { Note(event); }});
  }

  void Note(const std::string& line) {
    const MutexLock lock(&log_mutex);
    log += line + "\n";
  }

  void Note(const Event& event) {
    const MutexLock lock(&log_mutex);
    events.push_back(event.ToLine());
  }

  Mutex log_mutex;
  std::string log;                  ///< the warnings so far, a line each
  std::vector<std::string> events;  ///< the lines of the events so far
  TemporaryFolder folder;
  std::string address = "unix:" + (folder / "socket").string();
  SystemClock clock;
  std::unique_ptr<ModeDatabase> database = *ModeDatabase::Open(folder / "carillon.db", clock);
  std::unique_ptr<DecompositionQueue> queue = MakeQueue();
  std::unique_ptr<LiveOutput> output =
      *LiveOutput::Start({.device = "null"}, clock, [](const std::string&) {});
  SceneRegistry scenes{output->mixer()};
  std::unique_ptr<ApiServer> server;
};

}  // namespace carillon
