// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "server/api/api_server.h"
#include "server/daemon/data_directory.h"
#include "server/daemon/options.h"
#include "server/decomposition/worker/local_executor.h"
#include "server/live_output/live_output.h"

namespace carillon {

/// The parts of the daemon's settings that each room takes.
LocalExecutorOptions LocalExecutorOptionsOf(const Options& options);
OutputSettings OutputSettingsOf(const Options& options);
ApiSettings ApiSettingsOf(const Options& options);

/// Checks what the rooms will make of the settings, as far as this opens no device, listens at no
/// address and changes nothing. An error names the line of the configuration file that gives the
/// setting. Errors: those of DataDirectory::Check, CheckLocalExecutor, CheckDevice and
/// ApiServer::Check.
absl::Status CheckRooms(const CommandLine& command);

}  // namespace carillon
