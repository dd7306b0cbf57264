// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "client_sdk/cpp/client.h"
#include "proto/server_address.h"

namespace carillon::cli {

/// What all commands share: where the daemon is, how to print, and the one command that the command
/// line chose.
struct Program {
  std::string server = DefaultServerAddress();
  std::string admin_token;
  bool json = false;
  std::function<absl::Status()> command;

  client::Client Daemon() const {
    client::Client daemon(server);
    daemon.SetAdminToken(admin_token);
    return daemon;
  }
};

}  // namespace carillon::cli
